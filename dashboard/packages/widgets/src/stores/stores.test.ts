import fc from 'fast-check'
import { afterEach, beforeEach, expect, test, vi } from 'vitest'
import { ageOf, ageText, exactAge, formattedAge, formattedMs, sinceArrivalMs } from './age'
import { jsonOf } from './decode'
import { throttled } from './useReceived'

const bytes = (text: string) => new TextEncoder().encode(text).buffer

beforeEach(() => void vi.useFakeTimers())
afterEach(() => void vi.useRealTimers())

test('the age of a value counts from when the robot made it; before that is known, there is none', () => {
  expect(ageOf({ receivedAtMs: 1000, ageMs: 200 }, 1500)).toBe(700)
  expect(ageOf({ receivedAtMs: 1000, ageMs: -5 }, 900)).toBe(0)
  expect(ageOf({ receivedAtMs: 1000, ageMs: null }, 1500)).toBeNull()
  expect(sinceArrivalMs({ receivedAtMs: 1000 }, 1500)).toBe(500)
})

test.each([
  [200, 'live'],
  [1500, '1 s ago'],
  [150_000, '2 min ago'],
  [7_300_000, '2 h ago'],
])('an age of %d ms is told as %s', (ageMs, text) => {
  expect(formattedAge(ageMs)).toBe(text)
})

test.each([
  [3.04, '3.0 ms'],
  [999.4, '999 ms'],
  [2464, '2.5 s'],
  [12_400, '12 s'],
])('%s ms is %s', (ms, text) => expect(formattedMs(ms)).toBe(text))

test('an age that is not known is a dash', () => {
  expect([null, undefined, 40, 2500].map(ageText)).toEqual(['–', '–', '40 ms', '2.5 s'])
})

test('nothing lasts less than no time, however two clocks differ', () => {
  fc.assert(
    fc.property(fc.double({ min: -1e9, max: 0, noNaN: true }), (ms) => {
      for (const shown of [ageText, exactAge, formattedMs, formattedAge]) expect(shown(ms)).toBe(shown(0))
    }),
  )
})

test('what is not JSON is kept as text', () => {
  expect(jsonOf(bytes('{"a":1}'))).toEqual({ ok: true, value: { a: 1 } })
  expect(jsonOf(bytes('oops'))).toEqual({ ok: false, text: 'oops' })
})

test('a throttled action runs at once, not too often, and after the last call', () => {
  const action = vi.fn()
  const show = throttled(action, 100)
  show.call()
  expect(action).toHaveBeenCalledTimes(1)
  for (let index = 0; index < 10; index++) show.call()
  vi.advanceTimersByTime(100)
  expect(action).toHaveBeenCalledTimes(2)
  vi.advanceTimersByTime(1000)
  expect(action).toHaveBeenCalledTimes(2)
  show.call()
  show.call()
  show.cancel()
  vi.advanceTimersByTime(1000)
  expect(action).toHaveBeenCalledTimes(3)
})
