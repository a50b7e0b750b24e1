import { expect, test } from 'vitest'
import { formFields, messageOf } from './messageForm'
import { checkedJson, templateOf } from './template'

test('a message to start from has every field of the schema', () => {
  const schema = {
    properties: {
      gripper: { type: 'object', properties: { width_m: { type: 'number' }, name: { type: 'string' } } },
      on: { type: 'boolean' },
    },
  }
  expect(JSON.parse(templateOf(schema))).toEqual({ gripper: { width_m: 0, name: '' }, on: false })
  expect(templateOf(undefined)).toBe('{}')
})

test('a message to start from is one that the robot takes: its defaults, and values that it allows', () => {
  const schema = {
    properties: {
      speed: { type: 'number', default: 0.4 },
      mode: { type: 'string', enum: ['open', 'close'] },
      kind: { type: 'string', const: 'grip' },
      force: { $ref: '#/$defs/Force', default: 3 },
    },
    $defs: { Force: { type: 'integer', default: 9 } },
  }
  expect(JSON.parse(templateOf(schema))).toEqual({ speed: 0.4, mode: 'open', kind: 'grip', force: 3 })
})

const INNER = {
  type: 'object',
  properties: { kind: { type: 'string', enum: ['b', 'a'], default: 'b' }, gain: { type: 'number', default: 0.7 } },
}

test('the default of a part that is an object says with what its fields begin, or that it is left out', () => {
  const schema = {
    properties: {
      part: { $ref: '#/$defs/Inner', default: { kind: 'a', gain: 2 } },
      some: { $ref: '#/$defs/Inner', default: { gain: 3 } },
      left_out: { anyOf: [{ $ref: '#/$defs/Inner' }, { type: 'null' }], default: null },
      what: { anyOf: [{ $ref: '#/$defs/Inner' }, { const: 'none', type: 'string' }], default: 'none' },
    },
    $defs: { Inner: INNER },
  }
  const begins = { part: { kind: 'a', gain: 2 }, some: { kind: 'b', gain: 3 }, what: 'none' }
  expect(JSON.parse(templateOf(schema))).toEqual(begins)
  expect(messageOf(formFields(schema) ?? [], {})).toEqual({ ok: true, value: begins })
})

test('an object that must be there begins empty where the schema names no part of it', () => {
  const free = { type: 'object', additionalProperties: { type: 'number' } }
  const arm = { type: 'object', properties: { gains: free, name: { type: 'string' } }, required: ['gains', 'name'] }
  const schema = { properties: { gains: free, notes: free, arm }, required: ['gains', 'arm'] }
  expect(JSON.parse(templateOf(schema))).toEqual({ gains: {}, arm: { gains: {}, name: '' } })
})

test('only JSON leaves', () => {
  expect(checkedJson(' {"a": 1} ')).toEqual({ ok: true, text: '{"a":1}' })
  expect(checkedJson('{a: 1}').ok).toBe(false)
})
