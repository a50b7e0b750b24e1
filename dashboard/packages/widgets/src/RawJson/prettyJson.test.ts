import { expect, test } from 'vitest'
import { hexDump } from '../ByteView/hexDump'
import { groupedFields } from '../schema/groupedFields'
import { fieldValues } from '../schema/messageFields'
import { prettyJson } from './prettyJson'

const bytes = (text: string) => new TextEncoder().encode(text).buffer

test('objects take lines, lists of numbers take one', () => {
  expect(prettyJson(bytes('{"a":[1,null],"b":{"c":"x"},"d":{}}'))).toBe(
    '{\n  "a": [1, null],\n  "b": {\n    "c": "x"\n  },\n  "d": {}\n}',
  )
})

test('long lists are cut, lists of objects are indented', () => {
  expect(prettyJson(bytes(JSON.stringify(Array.from({ length: 30 }, (_, index) => index))))).toContain('… 6 more')
  expect(prettyJson(bytes('[{"a":1}]'))).toBe('[\n  {\n    "a": 1\n  }\n]')
})

test('what is not JSON is shown as it came', () => {
  expect(prettyJson(bytes('hello'))).toBe('hello')
  expect(prettyJson(bytes('x'.repeat(30_000))).length).toBeLessThan(20_010)
})

test('bytes are dumped in rows of sixteen', () => {
  expect(hexDump(bytes('Hello, robot 42!\n'))).toBe(
    '0000  48 65 6c 6c 6f 2c 20 72 6f 62 6f 74 20 34 32 21  Hello, robot 42!\n' +
      `0010  0a${' '.repeat(45)}  .`,
  )
  expect(hexDump(new ArrayBuffer(600))).toContain('… 88 more bytes')
})

test('values stand under the object they belong to', () => {
  const groups = groupedFields(fieldValues(undefined, { a: 1, linear_part: { x: 2 }, b: 3 }))
  expect(groups.map(({ heading, fields }) => [heading, fields.length])).toEqual([
    ['', 2],
    ['linear part', 1],
  ])
})
