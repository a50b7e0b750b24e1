import { expect, test } from 'vitest'
import { stickAt, thumbOffset } from './padGeometry'

const PAD = { left: 100, top: 50, width: 200, height: 200 }

test('the middle is rest, up is ahead, left is left', () => {
  expect(stickAt(200, 150, PAD)).toEqual({ forward: 0, left: 0 })
  expect(stickAt(200, 80, PAD)).toEqual({ forward: 1, left: 0 })
  expect(stickAt(130, 150, PAD)).toEqual({ forward: 0, left: 1 })
})

test('outside the pad is full deflection, never more', () => {
  const { forward, left } = stickAt(900, 900, PAD)
  expect(Math.hypot(forward, left)).toBeCloseTo(1)
})

test('a pad without size commands nothing', () => {
  expect(stickAt(5, 5, { left: 0, top: 0, width: 0, height: 0 })).toEqual({ forward: 0, left: 0 })
})

test('the thumb stands where the stick is and inside the pad', () => {
  expect(thumbOffset({ forward: 1, left: 0 })).toEqual({ xPercent: 0, yPercent: -35 })
})

test('two keys at once keep the thumb inside the round pad', () => {
  const { xPercent, yPercent } = thumbOffset({ forward: 1, left: 1 })
  expect(Math.hypot(xPercent, yPercent)).toBeCloseTo(35)
  expect(xPercent).toBeCloseTo(yPercent)
})
