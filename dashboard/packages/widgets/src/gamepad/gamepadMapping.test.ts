import fc from 'fast-check'
import { describe, expect, test } from 'vitest'
import {
  axisName,
  buttonName,
  isPressed,
  shaped,
  STANDARD_MAPPING,
  stickOfGamepad,
  UNKNOWN_MAPPING,
  type AxisMapping,
  type GamepadReading,
} from './gamepadMapping'

const PLAIN: AxisMapping = { axis: 0, deadZone: 0.1, exponent: 1, scale: 1, isInverted: false }
const mapping = fc.record<AxisMapping>({
  axis: fc.constant(0),
  deadZone: fc.double({ min: 0, max: 0.9, noNaN: true }),
  exponent: fc.double({ min: 0.5, max: 4, noNaN: true }),
  scale: fc.double({ min: 0, max: 1, noNaN: true }),
  isInverted: fc.boolean(),
})
const deflection = fc.double({ min: -1, max: 1, noNaN: true })

const reading = (axes: number[], pressed: number[] = []): GamepadReading => ({
  axes,
  buttons: Array.from({ length: 17 }, (_, index) => ({ pressed: pressed.includes(index), value: pressed.includes(index) ? 1 : 0 })),
})

describe('one axis', () => {
  test.each([
    [0, 0],
    [0.1, 0],
    [-0.1, 0],
    [1, 1],
    [-1, -1],
    [0.55, 0.5],
  ])('%s becomes %s', (value, expected) => expect(shaped(value, PLAIN)).toBeCloseTo(expected))

  test('a larger exponent makes small movements smaller and leaves the full one', () => {
    const fine = { ...PLAIN, exponent: 3 }
    expect(shaped(0.4, fine)).toBeLessThan(shaped(0.4, PLAIN))
    expect(shaped(1, fine)).toBe(1)
  })

  test('inverted is the other way, scaled is less', () => {
    expect(shaped(1, { ...PLAIN, isInverted: true, scale: 0.5 })).toBe(-0.5)
  })

  test('whatever the gamepad reports, the result is a number within the scale', () => {
    fc.assert(
      fc.property(fc.double(), mapping, (value, one) => {
        const result = shaped(value, one)
        expect(Number.isFinite(result)).toBe(true)
        expect(Math.abs(result)).toBeLessThanOrEqual(one.scale)
      }),
    )
  })

  test('inside the dead zone is rest', () => {
    fc.assert(fc.property(deflection, mapping, (value, one) => {
      fc.pre(Math.abs(value) <= one.deadZone)
      expect(shaped(value, one)).toBe(0)
    }))
  })

  test('more deflection never means less speed, and both ways are alike', () => {
    fc.assert(
      fc.property(deflection, deflection, mapping, (a, b, one) => {
        const way = one.isInverted ? -1 : 1
        const [low, high] = a < b ? [a, b] : [b, a]
        expect(way * shaped(high, one)).toBeGreaterThanOrEqual(way * shaped(low, one))
        expect(shaped(-a, one)).toBeCloseTo(-shaped(a, one))
      }),
    )
  })
})

describe('a standard gamepad', () => {
  test('at rest drives nowhere', () => {
    expect(stickOfGamepad(reading([0, 0, 0, 0]), STANDARD_MAPPING)).toEqual({ forward: 0, left: 0, sideways: 0 })
  })

  test('left stick up is ahead, right stick left is counter-clockwise', () => {
    const { forward, left } = stickOfGamepad(reading([0, -1, -1, 0]), STANDARD_MAPPING)
    expect([forward, left]).toEqual([1, 1])
  })

  test('needs its dead-man button', () => expect(STANDARD_MAPPING.needsDeadMan).toBe(true))
})

test('an axis that the gamepad does not have is rest', () => {
  expect(stickOfGamepad(reading([]), UNKNOWN_MAPPING)).toEqual({ forward: 0, left: 0, sideways: 0 })
})

test('a trigger counts as a button from half way', () => {
  const trigger = (value: number): GamepadReading => ({ axes: [], buttons: [{ pressed: false, value }] })
  expect(isPressed(trigger(0.4), 0)).toBe(false)
  expect(isPressed(trigger(0.6), 0)).toBe(true)
  expect(isPressed(trigger(1), 7)).toBe(false)
  expect(isPressed(trigger(1), null)).toBe(false)
})

test('buttons and axes are called as people know them', () => {
  expect(buttonName(4, true)).toBe('left shoulder (LB)')
  expect(buttonName(4, false)).toBe('button 4')
  expect(axisName(1, true)).toBe('left stick, up and down')
  expect(axisName(9, true)).toBe('axis 9')
})
