import fc from 'fast-check'
import { expect, test } from 'vitest'
import { escapePressed, TWICE_WITHIN_MS, type EscapePress, type LastEscape } from './stopKey'

function stopsOf(presses: EscapePress[]): number {
  let last: LastEscape = null
  return presses.filter((press) => {
    const result = escapePressed(last, press)
    last = result.last
    return result.stops
  }).length
}

const press = (atMs: number, isRepeat = false): EscapePress => ({ atMs, isRepeat })

test('one Escape closes a dialog and stops nothing', () => expect(stopsOf([press(0)])).toBe(0))

test('two in a hurry stop', () => expect(stopsOf([press(0), press(300)])).toBe(1))

test('two with a pause between them do not', () => expect(stopsOf([press(0), press(TWICE_WITHIN_MS + 1)])).toBe(0))

test('a late second one is the first of a new pair', () => {
  expect(stopsOf([press(0), press(2000), press(2200)])).toBe(1)
})

test('held, it stops once', () => expect(stopsOf([press(0), press(500, true), press(530, true), press(560, true)])).toBe(1))

test('it never stops at a first press, whatever happened before', () => {
  fc.assert(
    fc.property(fc.array(fc.integer({ min: TWICE_WITHIN_MS + 1, max: 100_000 })), (pausesMs) => {
      let atMs = 0
      expect(stopsOf(pausesMs.map((pauseMs) => press((atMs += pauseMs))))).toBe(0)
    }),
  )
})

test('hammering it always stops', () => {
  fc.assert(
    fc.property(fc.array(fc.integer({ min: 0, max: TWICE_WITHIN_MS }), { minLength: 2 }), (pausesMs) => {
      let atMs = 0
      expect(stopsOf(pausesMs.map((pauseMs) => press((atMs += pauseMs))))).toBe(Math.floor(pausesMs.length / 2))
    }),
  )
})
