import fc from 'fast-check'
import { expect, test } from 'vitest'
import { levelDb, meterShare, QUIET_DB } from './soundLevel'

test('full scale is 0 dB, a tenth of it -20 dB, silence less than anything', () => {
  expect(levelDb([1, -1, 1])).toBeCloseTo(0)
  expect(levelDb(Array<number>(100).fill(0.1))).toBeCloseTo(-20)
  expect(levelDb([0, 0])).toBe(-Infinity)
  expect(levelDb([])).toBe(-Infinity)
})

test('the meter is empty at silence, half at half of its range, full at full scale', () => {
  expect([-Infinity, QUIET_DB, QUIET_DB / 2, 0, 3].map(meterShare)).toEqual([0, 0, 0.5, 1, 1])
})

test('what is louder is never shown shorter', () => {
  const samples = fc.array(fc.float({ min: -1, max: 1, noNaN: true }), { minLength: 1 })
  fc.assert(
    fc.property(samples, fc.double({ min: 0, max: 1, noNaN: true }), (sound, factor) => {
      const softer = sound.map((sample) => sample * factor)
      const share = meterShare(levelDb(softer))
      expect(share).toBeLessThanOrEqual(meterShare(levelDb(sound)) + 1e-9)
      expect(share).toBeGreaterThanOrEqual(0)
    }),
  )
})
