import { act, renderHook } from '@testing-library/react'
import { expect, test } from 'vitest'
import type { JsonSchema } from '../schema/jsonSchema'
import { useNumericFields } from './useNumericFields'

const SCHEMA: JsonSchema = {
  properties: { range: { anyOf: [{ type: 'number' }, { type: 'null' }], unit: 'm' }, tilt: { type: 'number', unit: 'rad', default: null } },
}

function numbersOf(schema: JsonSchema | undefined) {
  const { result, rerender } = renderHook(({ its }: { its: JsonSchema | undefined }) => useNumericFields(its), {
    initialProps: { its: schema },
  })
  const known = () => result.current[0].map(({ path, unit }) => [path.join('.'), unit])
  const learn = (message: unknown) => act(() => void result.current[1](message))
  return { known, learn, rerender, fields: () => result.current[0] }
}

test('a schema that comes after the first message brings the units', () => {
  const { known, learn, rerender } = numbersOf(undefined)
  learn({ range: 1.5 })
  expect(known()).toEqual([['range', '']])
  rerender({ its: SCHEMA })
  expect(known()).toEqual([['range', 'm']])
})

test('the same schema in another object changes nothing, and fields that are there once stay', () => {
  const { known, learn, rerender, fields } = numbersOf(SCHEMA)
  learn({ range: 1.5, tilt: 0.1 })
  learn({ range: 1.5 })
  const before = fields()
  rerender({ its: structuredClone(SCHEMA) })
  expect(known()).toEqual([
    ['range', 'm'],
    ['tilt', 'rad'],
  ])
  expect(fields()).toBe(before)
})
