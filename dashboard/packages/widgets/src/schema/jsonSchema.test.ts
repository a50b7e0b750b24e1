import { expect, test } from 'vitest'
import { fieldsOf, hasPaths, nameOf, unitFromName } from './jsonSchema'
import { fieldValues, formatted, formattedNumber, numericFields } from './messageFields'

const POSE = {
  type: 'object',
  properties: {
    position: { $ref: '#/$defs/Position' },
    battery: { anyOf: [{ $ref: '#/$defs/Battery' }, { type: 'null' }], default: null },
    ranges: { type: 'array', unit: 'm', items: { anyOf: [{ type: 'number' }, { type: 'null' }] } },
    timestamp: { type: 'integer', unit: 'us' },
  },
  $defs: {
    Position: { type: 'object', properties: { x: { type: 'number', unit: 'm' }, y: { type: 'number', unit: 'm' } } },
    Battery: { type: 'object', properties: { voltage_v: { type: 'number' } } },
  },
}

test('fields are found through references and optionals, with their units', () => {
  const fields = fieldsOf(POSE).map(({ path, unit }) => `${path.join('.')} ${unit}`.trim())
  expect(fields).toEqual(['position.x m', 'position.y m', 'battery.voltage_v V', 'ranges m', 'timestamp µs'])
})

test('a schema that refers to itself ends', () => {
  const node = { $ref: '#/$defs/Node' }
  const schema = { $defs: { Node: { type: 'object', properties: { next: node, value: { type: 'number' } } } }, ...node }
  expect(fieldsOf(schema).length).toBeLessThan(10)
})

test('paths are looked up through references', () => {
  expect(hasPaths(POSE, ['position.x', 'battery.voltage_v'])).toBe(true)
  expect(hasPaths(POSE, ['position.z'])).toBe(false)
  expect(hasPaths(undefined, ['x'])).toBe(false)
})

test('units come from names where the schema has none', () => {
  expect(unitFromName('max_linear_mps')).toBe('m/s')
  expect(unitFromName('s')).toBe('')
  expect(nameOf('voltage_v')).toBe('Voltage')
  expect(nameOf('load_1_min')).toBe('Load 1 min')
})

test('names, units and texts of a robot are plain text; the path stays as it is in the message', () => {
  const key = 'gr\u202eip\u200b_v'
  const [declared] = fieldsOf({ properties: { [key]: { type: 'number', unit: 'V\n', description: 'of\u001b[2J' } } })
  expect(declared).toEqual({ path: [key], name: 'Gr\ufffdip', kind: 'number', unit: 'V ', description: 'of\ufffd[2J' })
  expect(fieldValues(undefined, { [key]: 'a\nb' })[0]).toMatchObject({ name: 'Gr\ufffdip', value: 'a\nb' })
  expect(formatted('a\nb')).toBe('a b')
})

test('what may be left out is shown where it is not', () => {
  const schema = { properties: { a: { type: 'number' }, b: { type: 'number', default: null }, c: { type: 'number', default: 1 } } }
  const names = (message: unknown) => fieldValues(schema, message).map(({ path }) => path.join('.'))
  expect(names({ a: 1 })).toEqual(['a', 'c'])
  expect(names({ a: 1, b: null })).toEqual(['a', 'b', 'c'])
  expect(numericFields(schema, undefined)).toHaveLength(2)
  expect(numericFields(schema, { b: 2 })).toHaveLength(3)
})

test('without a schema the message itself tells its fields', () => {
  const values = fieldValues(undefined, { a: { percent: 5 }, ok: true, text: 'x', list: [1, 2] })
  expect(values.map(({ path, kind }) => [path.join('.'), kind])).toEqual([
    ['a.percent', 'number'],
    ['ok', 'boolean'],
    ['text', 'string'],
    ['list', 'array'],
  ])
})

test('a time stamp is no curve', () => {
  expect(numericFields(POSE, undefined).map(({ path }) => path.join('.'))).not.toContain('timestamp')
})

test.each([
  [null, '', '–'],
  [true, '', 'yes'],
  ['ok', '', 'ok'],
  [33.333, '%', '33.3'],
  [[1, 2.5], '', '1.000, 2.500'],
  [[1, 2, 3, 4, 5, 6, 7], '', '7 values'],
  [{ a: 1 }, '', '{"a":1}'],
])('%j is shown as %s%s', (value, unit, text) => {
  expect(formatted(value, unit)).toBe(text)
})

test.each([
  [0, '0.000'],
  [-0.0006, '-0.001'],
  [1e-9, '1.00e-9'],
  [12.345, '12.35'],
  [123.45, '123.5'],
  [1234.5, '1235'],
  [123456789, '123456789'],
  [NaN, '–'],
])('the number %d is shown as %s', (value, text) => {
  expect(formattedNumber(value)).toBe(text)
})
