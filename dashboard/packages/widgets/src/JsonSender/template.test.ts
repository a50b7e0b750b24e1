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

test('only JSON leaves', () => {
  expect(checkedJson(' {"a": 1} ')).toEqual({ ok: true, text: '{"a":1}' })
  expect(checkedJson('{a: 1}').ok).toBe(false)
})
