import fc from 'fast-check'
import { expect, test } from 'vitest'
import { SLEPT_MS, SleepWatch } from '../../src/timing/SleepWatch'

const WALL_MS = 1_800_000_000_000

/** Looks of a page whose clock passes `nowMs` and whose wall clock passes `wallMs` between two of them. */
function looks(steps: readonly { nowMs: number; wallMs: number }[]): number[] {
  const watch = new SleepWatch()
  let [nowMs, wallMs] = [0, WALL_MS]
  watch.uncountedMs(nowMs, wallMs)
  return steps.map((step) => watch.uncountedMs((nowMs += step.nowMs), (wallMs += step.wallMs)))
}

test('a sleep that only the wall clock counted is told once', () => {
  const awake = { nowMs: 500, wallMs: 500 }
  expect(looks([awake, { nowMs: 500, wallMs: 3_600_500 }, awake])).toEqual([0, 3_600_000, 0])
})

test('a sleep that both clocks counted is none of its business', () => {
  expect(looks([{ nowMs: 3_600_000, wallMs: 3_600_000 }])).toEqual([0])
})

test('a wall clock that is set back, or a little forward, is no sleep', () => {
  expect(looks([{ nowMs: 500, wallMs: -3_600_000 }, { nowMs: 500, wallMs: 500 + SLEPT_MS }])).toEqual([0, 0])
})

test('nothing is told of the first look', () => {
  expect(new SleepWatch().uncountedMs(5, WALL_MS)).toBe(0)
})

test('however the clocks drift apart, only what the wall clock has ahead of the other is told, and only if that is much', () => {
  const step = fc.record({ nowMs: fc.nat(10_000), wallMs: fc.integer({ min: -10_000, max: 100_000 }) })
  fc.assert(
    fc.property(fc.array(step), (steps) => {
      looks(steps).forEach((told, index) => {
        const { nowMs, wallMs } = steps[index] ?? { nowMs: 0, wallMs: 0 }
        expect(told).toBe(wallMs - nowMs > SLEPT_MS ? wallMs - nowMs : 0)
      })
    }),
  )
})
