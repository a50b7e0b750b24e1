import { expect, test } from 'vitest'
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

test('only JSON leaves', () => {
  expect(checkedJson(' {"a": 1} ')).toEqual({ ok: true, text: '{"a":1}' })
  expect(checkedJson('{a: 1}').ok).toBe(false)
})
