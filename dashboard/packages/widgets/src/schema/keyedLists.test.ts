import { expect, test } from 'vitest'
import { elementKeys, elementNames } from './keyedLists'
import { numericFields, valueAt } from './messageFields'

const STATE = { names: ['elbow', 'wrist'], positions: [0.5, 1], velocities: [], label: 'arm' }
const SCHEMA = {
  properties: {
    names: { type: 'array' },
    positions: { type: 'array', unit: 'rad' },
    velocities: { type: 'array', unit: 'rad/s' },
    limits: { type: 'array', items: { type: 'object' } },
  },
}

test('the elements of lists that stand beside their names are numbers to plot, with the unit of their list', () => {
  expect(numericFields(SCHEMA, STATE).map(({ path, name, unit }) => [path.join('.'), name, unit])).toEqual([
    ['positions.elbow', 'elbow', 'rad'],
    ['positions.wrist', 'wrist', 'rad'],
  ])
  expect(valueAt(STATE, ['positions', 'wrist'])).toBe(1)
  expect(valueAt({ ...STATE, names: ['wrist', 'elbow'] }, ['positions', 'wrist'])).toBe(0.5)
  expect(numericFields(undefined, { name: ['a'], position: [3] }).map(({ path }) => path)).toEqual([['position', 'a']])
})

test('short lists without names are vectors, long ones are none', () => {
  const message = { wheel: { speeds_mps: [1, 2] }, ranges: [1, 2, 3, 4, 5, 6, 7] }
  expect(numericFields(undefined, message).map(({ path, name, unit }) => [path.join('.'), name, unit])).toEqual([
    ['wheel.speeds_mps.0', 'Speeds 0', 'm/s'],
    ['wheel.speeds_mps.1', 'Speeds 1', 'm/s'],
  ])
  expect(valueAt(message, ['wheel', 'speeds_mps', '1'])).toBe(2)
  expect(valueAt(message, ['wheel', 'speeds_mps', 'x'])).toBeUndefined()
})

test('names that are not unique name nothing', () => {
  expect(elementNames({ names: ['a', 'a'] })).toBeNull()
  expect(elementNames({ names: [1] })).toBeNull()
  expect(elementNames(null)).toBeNull()
  expect(elementKeys({}, ['a'])).toBeNull()
  expect(elementKeys({ names: Array.from({ length: 100 }, (_, index) => String(index)) }, Array.from({ length: 100 }, () => 0))).toHaveLength(64)
})
