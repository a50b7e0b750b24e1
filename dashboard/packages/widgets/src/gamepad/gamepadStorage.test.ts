import fc from 'fast-check'
import { expect, test } from 'vitest'
import { AXIS_LIMITS, DRIVE_AXES, STANDARD_MAPPING, UNKNOWN_MAPPING, type GamepadMapping } from './gamepadMapping'
import { forgetMapping, readMapping, validMapping, writeMapping, type MappingStorage } from './gamepadStorage'

const KNOWN = { id: 'Xbox 360 Controller (STANDARD GAMEPAD)', mapping: 'standard' }
const STRANGE = { id: 'Joystick from 1998', mapping: '' }

function storage(): MappingStorage & { kept: Map<string, string> } {
  const kept = new Map<string, string>()
  return {
    kept,
    getItem: (key) => kept.get(key) ?? null,
    setItem: (key, value) => void kept.set(key, value),
    removeItem: (key) => void kept.delete(key),
  }
}

const FORBIDDEN: MappingStorage = {
  getItem: () => {
    throw new Error('no')
  },
  setItem: () => {
    throw new Error('no')
  },
  removeItem: () => {
    throw new Error('no')
  },
}

test('a gamepad that the browser knows drives with the standard mapping', () => {
  expect(readMapping(storage(), KNOWN)).toEqual({ mapping: STANDARD_MAPPING, isTrusted: true })
})

test('one that it does not know has to be looked at first', () => {
  expect(readMapping(storage(), STRANGE)).toEqual({ mapping: UNKNOWN_MAPPING, isTrusted: false })
})

test('a mapping is remembered per kind of gamepad, and can be forgotten', () => {
  const kept = storage()
  const mine: GamepadMapping = { ...UNKNOWN_MAPPING, deadManButton: 5, stopButton: null }
  expect(writeMapping(kept, STRANGE, mine)).toBe(true)
  expect(readMapping(kept, STRANGE)).toEqual({ mapping: mine, isTrusted: true })
  expect(readMapping(kept, KNOWN).mapping).toEqual(STANDARD_MAPPING)
  forgetMapping(kept, STRANGE)
  expect(readMapping(kept, STRANGE).isTrusted).toBe(false)
})

test('a storage that is forbidden disturbs nothing', () => {
  expect(readMapping(FORBIDDEN, KNOWN).mapping).toEqual(STANDARD_MAPPING)
  expect(writeMapping(FORBIDDEN, KNOWN, STANDARD_MAPPING)).toBe(false)
  expect(() => forgetMapping(FORBIDDEN, KNOWN)).not.toThrow()
})

test('text that is not JSON is no mapping', () => {
  const kept = storage()
  kept.setItem(`mosaic.gamepad.${STRANGE.id}`, '{nonsense')
  expect(readMapping(kept, STRANGE).isTrusted).toBe(false)
})

test('whatever is stored, the mapping is valid and needs the dead-man button unless somebody said no', () => {
  fc.assert(
    fc.property(fc.jsonValue(), (value) => {
      const mapping = validMapping(value, STANDARD_MAPPING)
      for (const way of DRIVE_AXES) {
        const { axis, ...numbers } = mapping.axes[way]
        expect(axis === null || (Number.isInteger(axis) && axis >= 0)).toBe(true)
        for (const name of ['deadZone', 'exponent', 'scale'] as const) {
          expect(numbers[name]).toBeGreaterThanOrEqual(AXIS_LIMITS[name].least)
          expect(numbers[name]).toBeLessThanOrEqual(AXIS_LIMITS[name].most)
        }
      }
      const saidNo = typeof value === 'object' && value !== null && 'needsDeadMan' in value && value.needsDeadMan === false
      expect(mapping.needsDeadMan).toBe(!saidNo)
    }),
  )
})

test('what does not fit is taken from the default', () => {
  const mapping = validMapping({ axes: { forward: { axis: -3, deadZone: 7, exponent: 'x' } }, stopButton: 2.5 }, STANDARD_MAPPING)
  expect(mapping.axes.forward).toEqual({ ...STANDARD_MAPPING.axes.forward, deadZone: 0.9 })
  expect(mapping.stopButton).toBe(STANDARD_MAPPING.stopButton)
})
