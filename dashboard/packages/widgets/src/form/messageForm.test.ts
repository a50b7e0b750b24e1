import fc from 'fast-check'
import { expect, test } from 'vitest'
import { choicesOf, formFields, inputsOf, keyOf, messageOf, readInput, type Inputs } from './messageForm'

const GRIP = {
  properties: {
    width_m: { type: 'number', minimum: 0, exclusiveMaximum: 0.1 },
    force_n: { anyOf: [{ type: 'number', exclusiveMinimum: 0, maximum: 40 }, { type: 'null' }], default: null },
    fingers: { type: 'integer', default: 2 },
    mode: { type: 'string', enum: ['soft', 'firm'] },
    slow: { type: 'boolean', default: false },
    tags: { type: 'array', default: [] },
    note: { type: 'string', default: '' },
    place: { $ref: '#/$defs/Place' },
  },
  $defs: { Place: { type: 'object', properties: { x_m: { type: 'number', default: 0 } } } },
}
const FIELDS = formFields(GRIP) ?? []
const sent = (inputs: Inputs) => messageOf(FIELDS, inputs)

test('a form that nobody touched lacks what the schema does not say', () => {
  expect(FIELDS.map(keyOf)).toEqual(['width_m', 'force_n', 'fingers', 'mode', 'slow', 'tags', 'note', 'place.x_m'])
  expect(sent({})).toEqual({ ok: false, problem: 'Width is missing' })
})

test('what is filled in becomes the message; what is left out is not in it', () => {
  expect(sent({ width_m: ' 0.05 ', fingers: '', slow: true, tags: '["a"]', mode: 'firm', note: ' as it is ' })).toEqual({
    ok: true,
    value: { width_m: 0.05, mode: 'firm', slow: true, tags: ['a'], note: ' as it is ', place: { x_m: 0 } },
  })
})

test.each([
  [{ width_m: 'wide' }, 'Width is no number'],
  [{ width_m: '-1' }, 'Width is at least 0 m'],
  [{ width_m: '0.1' }, 'Width is less than 0.1 m'],
  [{ width_m: '0', force_n: '0' }, 'Force n is more than 0'],
  [{ width_m: '0', force_n: '41' }, 'Force n is at most 40'],
  [{ width_m: '0', fingers: '2.5' }, 'Fingers is a whole number'],
  [{ width_m: '0', mode: 'hard' }, 'Mode is none of soft, firm'],
  [{ width_m: '0', mode: '' }, 'Mode is missing'],
  [{ width_m: '0', tags: '{}' }, 'Tags is a list such as [1, 2]'],
  [{ width_m: '0', tags: '[1' }, 'Tags is a list such as [1, 2]'],
])('%o can not be sent, and why is said', (inputs, problem) => {
  expect(sent(inputs as unknown as Inputs)).toEqual({ ok: false, problem })
})

test('a message that is shown in the form is the one that would be sent', () => {
  const message = fc.record({
    width_m: fc.double({ min: 0, max: 0.09, noNaN: true }).map((value) => value + 0),
    fingers: fc.integer({ min: -9, max: 9 }),
    mode: fc.constantFrom('soft', 'firm'),
    slow: fc.boolean(),
    tags: fc.array(fc.integer(), { maxLength: 3 }),
    note: fc.string({ minLength: 1 }),
    place: fc.record({ x_m: fc.double({ min: -1, max: 1, noNaN: true }).map((value) => value + 0) }),
  })
  fc.assert(
    fc.property(message, (value) => {
      expect(sent(inputsOf(FIELDS, value))).toEqual({ ok: true, value })
    }),
  )
})

test('choices are those that the schema allows; what it does not begin with may be left out', () => {
  const [first, second] = formFields({
    properties: {
      on: { anyOf: [{ type: 'boolean' }, { type: 'null' }], default: null },
      level: { type: 'integer', enum: [1, 2], default: 2 },
    },
  }) ?? []
  expect(first && choicesOf(first)?.map(({ label }) => label)).toEqual(['not said', 'yes', 'no'])
  expect(first && readInput(first, 'true')).toEqual({ ok: true, value: true })
  expect(first && readInput(first, '')).toEqual({ ok: true, value: undefined })
  expect(second && choicesOf(second)?.map(({ value }) => value)).toEqual(['1', '2'])
  expect(second && readInput(second, '2')).toEqual({ ok: true, value: 2 })
})

test('what a form can not say wholly is text', () => {
  expect(formFields(undefined)).toBeNull()
  expect(formFields({ properties: {} })).toBeNull()
  expect(formFields({ properties: { a: { type: 'number' }, free: { type: 'object' } } })).toBeNull()
  expect(formFields({ properties: { a: { type: 'number' }, part: { type: 'object', properties: { free: {} } } } })).toBeNull()
  const many = Object.fromEntries(Array.from({ length: 33 }, (_, index) => [`f${index}`, { type: 'number' }]))
  expect(formFields({ properties: many })).toBeNull()
})
