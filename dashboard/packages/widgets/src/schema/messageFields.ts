/** The values of one message, flat and named: from its schema where there is one, else from the message itself. */
import { plainText } from '@mosaic/client'
import { fieldsOf, isObject, nameOf, unitFromName, type Field, type JsonSchema } from './jsonSchema'
import { elementFields, elementOf } from './keyedLists'

export interface FieldValue extends Field {
  value: unknown
}

/** A list longer than this is data for a plot, not for a reader. */
const MAX_LIST = 6

export function fieldValues(schema: JsonSchema | undefined, message: unknown): FieldValue[] {
  return fieldsThere(schema, message).map((field) => ({ ...field, value: valueAt(message, field.path) }))
}

/** Those that a plot can draw: also the elements of lists, by the names beside them. */
export function numericFields(schema: JsonSchema | undefined, message: unknown): Field[] {
  return fieldsThere(schema, message)
    .flatMap((field) => (field.kind === 'array' ? elementsOf(field, message) : [field]))
    .filter(isPlottable)
}

/** Whether messages of this schema may have anything that a plot can draw; where nothing is declared they may. */
export function mayHaveNumbers(schema: JsonSchema | undefined): boolean {
  const declared = fieldsOf(schema)
  return declared.length === 0 || declared.some((field) => isPlottable(field) || field.holdsNumbers === true)
}

/** What counts the time is the axis, and no curve. */
function isPlottable(field: Field): boolean {
  return field.kind === 'number' && field.path.at(-1) !== 'timestamp'
}

function elementsOf(field: Field, message: unknown): Field[] {
  return elementFields(field, valueAt(message, field.path.slice(0, -1)), valueAt(message, field.path))
}

/** What the schema declares, without what may be left out (it is null by default) and is; without a schema, what is there. */
function fieldsThere(schema: JsonSchema | undefined, message: unknown): Field[] {
  const declared = fieldsOf(schema)
  if (declared.length === 0) return fieldsOfMessage(message)
  return declared.filter((field) => field.initial !== null || valueAt(message, field.path) !== undefined)
}

/** What stands at a path; an element of a list is reached by its name, or its number in a short one. */
export function valueAt(message: unknown, path: readonly string[]): unknown {
  let owner: unknown
  let value = message
  for (const key of path) {
    const inner = Array.isArray(value) ? elementOf(owner, value, key) : isObject(value) ? value[key] : undefined
    owner = value
    value = inner
  }
  return value
}

export function fieldsOfMessage(message: unknown, path: readonly string[] = []): Field[] {
  if (!isObject(message) || path.length > 4) return []
  return Object.entries(message).flatMap(([key, value]) => {
    const here = [...path, key]
    if (isObject(value)) return fieldsOfMessage(value, here)
    return [{ path: here, name: nameOf(key), kind: kindOfValue(value), unit: unitFromName(key), description: '' }]
  })
}

function kindOfValue(value: unknown): Field['kind'] {
  if (Array.isArray(value)) return 'array'
  if (typeof value === 'number' || value === null) return 'number'
  return typeof value === 'boolean' ? 'boolean' : 'string'
}

/** A value as text of a steady width; what is missing is a dash. */
export function formatted(value: unknown, unit = '', isInteger = false): string {
  if (value === null || value === undefined) return '–'
  if (typeof value === 'number' && isInteger && Number.isInteger(value)) return String(value)
  if (typeof value === 'number') return unit === '%' ? formattedPercent(value) : formattedNumber(value)
  if (typeof value === 'boolean') return value ? 'yes' : 'no'
  if (Array.isArray(value)) return formattedList(value)
  return plainText(typeof value === 'string' ? value : JSON.stringify(value))
}

function formattedPercent(value: number): string {
  return Number.isFinite(value) ? withoutNegativeZero(value.toFixed(1)) : '–'
}

export function formattedNumber(value: number): string {
  if (!Number.isFinite(value)) return '–'
  const size = Math.abs(value)
  if (Number.isInteger(value) && size >= 1000) return String(value)
  if (size >= 1e7 || (size > 0 && size < 5e-4)) return value.toExponential(2)
  return withoutNegativeZero(value.toFixed(size >= 1000 ? 0 : size >= 100 ? 1 : size >= 10 ? 2 : 3))
}

function withoutNegativeZero(text: string): string {
  return /^-0\.?0*$/.test(text) ? text.slice(1) : text
}

function formattedList(values: readonly unknown[]): string {
  if (values.length > MAX_LIST) return `${values.length} values`
  return values.map((value) => formatted(value)).join(', ')
}
