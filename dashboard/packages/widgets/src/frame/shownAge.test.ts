import fc from 'fast-check'
import { expect, test } from 'vitest'
import { lastPictureText, shownAge } from './shownAge'

const STAMPED = { receivedAtMs: 1000, stampUs: 5, latched: false, ageMs: 0 }
const ORIGINAL = { ...STAMPED, stampUs: 0, ageMs: null }

test('without a value there is no age', () => {
  expect(shownAge(null, false, 1000)).toEqual({ text: 'no value yet', state: 'none' })
  expect(shownAge(null, false, 1000, true)).toEqual({ text: 'failed', state: 'away' })
  expect(shownAge(null, true, 1000, true)).toEqual({ text: 'reconnecting', state: 'away' })
  expect(shownAge(null, true, 1000)).toEqual({ text: 'reconnecting', state: 'away' })
})

test('a known age counts on', () => {
  expect(shownAge(STAMPED, false, 1200)).toEqual({ text: 'live', state: 'live' })
  expect(shownAge({ ...STAMPED, ageMs: 20_000 }, false, 4000)).toEqual({ text: '23 s ago', state: 'old' })
  expect(shownAge({ ...STAMPED, ageMs: 20_000 }, true, 4000).text).toBe('reconnecting · 23 s old')
})

test('while the connection is away, an unknown age is told as the least that it can be', () => {
  expect(shownAge({ ...STAMPED, ageMs: null }, true, 4200).text).toBe('reconnecting · over 3.2 s old')
})

test('the last picture of before has an age too', () => {
  expect(lastPictureText(null, 4200)).toBe('')
  expect(lastPictureText({ shownAtMs: 1000, ageMs: 100 }, 4200)).toBe('last picture 3.3 s old')
  expect(lastPictureText({ shownAtMs: 1000, ageMs: null }, 4200)).toBe('last picture over 3.2 s old')
})

test('of an original robot only the arrival is known', () => {
  expect(shownAge(ORIGINAL, false, 1500)).toEqual({ text: 'received now', state: 'unknown' })
  expect(shownAge(ORIGINAL, false, 6000)).toEqual({ text: 'received 5 s ago', state: 'old' })
})

test('whatever is unknown never looks live', () => {
  fc.assert(
    fc.property(fc.nat(), fc.boolean(), fc.boolean(), fc.nat(), (stampUs, latched, isAway, laterMs) => {
      const { text, state } = shownAge({ receivedAtMs: 1000, stampUs, latched, ageMs: null }, isAway, 1000 + laterMs)
      return state !== 'live' && !text.includes('live')
    }),
  )
})
