import { expect, test } from 'vitest'
import type { Field } from '../schema/jsonSchema'
import { curvesOf, limitedFields, scaleRange } from './limits'
import { plotOptions } from './plotOptions'

const field = (name: string): Field => ({ path: [name], name, kind: 'number', unit: 'm', description: '' })
const RANGE = ['range', 'range_min', 'range_max', 'field_of_view'].map(field)
const LOOK = { line: '#000', muted: '#000', series: [] }

test('the limits of a measurement are no curves', () => {
  expect(curvesOf(RANGE).map(({ name }) => name)).toEqual(['range', 'field_of_view'])
  expect(limitedFields(RANGE).map(({ field: its, max }) => [its.name, max.name])).toEqual([['range', 'range_max']])
})

test('a limit alone, or of nothing that is sent, is a value like any other', () => {
  for (const names of [['range', 'range_max'], ['load_min', 'load_max']]) {
    expect(curvesOf(names.map(field)).map(({ name }) => name)).toEqual(names)
  }
})

test('a scale goes as far as the limits, and as far as a value beyond them', () => {
  expect(scaleRange(1, 2, [0, 4])).toEqual([0, 4])
  expect(scaleRange(1, 5, [0, 4])).toEqual([0, 5])
  expect(scaleRange(null, null, [0, 4])).toEqual([0, 4])
  expect(scaleRange(null, null, [])).toEqual([0, 1])
  expect(scaleRange(3, 3, [])).toEqual([2.5, 3.5])
})

test('values that would be a flat line are shown up to the nearer limit alone', () => {
  expect(scaleRange(1, 3, [0, 40])).toEqual([0, 3])
  expect(scaleRange(37, 39, [0, 40])).toEqual([37, 40])
  expect(scaleRange(1, 10, [0, 40])).toEqual([0, 40])
  expect(scaleRange(0, 0, [0, 40])).toEqual([-0.5, 0.5])
})

test('a unit with limits has a scale of its own, the others are left to the plot', () => {
  const limitsOf = (unit: string) => (unit === 'm' ? [0, 4] : [])
  const { scales } = plotOptions([field('range'), { ...field('load'), unit: '%' }], LOOK, 30, limitsOf)
  const range = scales?.['unit:m']?.range
  expect(typeof range === 'function' && range({} as never, 1, 2, 'unit:m')).toEqual([0, 4])
  expect(scales?.['unit:%']).toBeUndefined()
})
