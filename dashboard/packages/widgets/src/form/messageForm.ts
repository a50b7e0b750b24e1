/** A message as a form: what each field of a schema may hold, and what a person typed as the message that will be sent. */
import { plainText } from '@mosaic/client'
import { fieldsOf, isWhollyFields, type Field, type JsonSchema } from '../schema/jsonSchema'
import { valueAt } from '../schema/messageFields'

/** What stands in an input: text, or a switch. */
export type Input = string | boolean

/** By the field's path, joined with dots; what is not here stands as the schema begins it. */
export type Inputs = Readonly<Record<string, Input>>

export type Read = { ok: true; value: unknown } | { ok: false; problem: string }

/** More fields than this are a document, which is better written as text. */
const MAX_FIELDS = 32

export function keyOf(field: Field): string {
  return field.path.join('.')
}

/** The fields of a form; null where a form can't say all that the message may hold. */
export function formFields(schema: JsonSchema | undefined): Field[] | null {
  const fields = fieldsOf(schema)
  return fields.length <= MAX_FIELDS && isWhollyFields(schema) ? fields : null
}

/** The choices of a field that allows only some values; one without a default may also be left out. */
export function choicesOf(field: Field): { value: string; label: string }[] | null {
  const allowed = field.allowed ?? (field.kind === 'boolean' && field.isOptional === true ? [true, false] : null)
  if (allowed === null) return null
  const choices = allowed.filter((value) => value !== null).map((value) => ({ value: textOf(value), label: labelOf(value) }))
  return field.isOptional === true && field.initial == null ? [{ value: '', label: 'not said' }, ...choices] : choices
}

function labelOf(value: unknown): string {
  if (typeof value === 'boolean') return value ? 'yes' : 'no'
  return plainText(textOf(value))
}

function textOf(value: unknown): string {
  return typeof value === 'string' ? value : JSON.stringify(value)
}

/** How a value of the message stands in its input. */
export function inputOf(field: Field, value: unknown): Input {
  if (field.kind === 'boolean' && choicesOf(field) === null) return value === true
  if (value === null || value === undefined) return ''
  return textOf(value)
}

/** All inputs of a form that shows this message. */
export function inputsOf(fields: readonly Field[], message: unknown): Inputs {
  return Object.fromEntries(fields.map((field) => [keyOf(field), inputOf(field, valueAt(message, field.path))]))
}

/** The value that an input stands for; undefined where the field is left out. */
export function readInput(field: Field, input: Input): Read {
  if (typeof input === 'boolean') return { ok: true, value: input }
  const choices = field.allowed ?? (field.kind === 'boolean' ? [true, false] : null)
  const typed = choices === null && field.kind === 'string' ? input : input.trim()
  if (typed === '' && (field.isOptional === true || field.kind !== 'string' || choices !== null)) return leftOut(field)
  if (choices !== null) return among(choices, typed)
  if (field.kind === 'number') return numberIn(field, typed)
  return field.kind === 'array' ? listIn(typed) : { ok: true, value: typed }
}

function leftOut(field: Field): Read {
  return field.isOptional === true ? { ok: true, value: undefined } : { ok: false, problem: 'is missing' }
}

function among(choices: readonly unknown[], typed: string): Read {
  const place = choices.findIndex((choice) => textOf(choice) === typed)
  return place < 0 ? { ok: false, problem: `is none of ${choices.map(textOf).join(', ')}` } : { ok: true, value: choices[place] }
}

function numberIn(field: Field, typed: string): Read {
  const value = Number(typed)
  if (!Number.isFinite(value)) return { ok: false, problem: 'is no number' }
  if (field.isInteger === true && !Number.isInteger(value)) return { ok: false, problem: 'is a whole number' }
  const { minimum, maximum, above, below } = field.range ?? {}
  const unit = field.unit === '' ? '' : ` ${field.unit}`
  if (minimum !== undefined && value < minimum) return { ok: false, problem: `is at least ${minimum}${unit}` }
  if (maximum !== undefined && value > maximum) return { ok: false, problem: `is at most ${maximum}${unit}` }
  if (above !== undefined && value <= above) return { ok: false, problem: `is more than ${above}${unit}` }
  if (below !== undefined && value >= below) return { ok: false, problem: `is less than ${below}${unit}` }
  return { ok: true, value }
}

function listIn(typed: string): Read {
  try {
    const value: unknown = JSON.parse(typed)
    return Array.isArray(value) ? { ok: true, value } : { ok: false, problem: 'is a list such as [1, 2]' }
  } catch {
    return { ok: false, problem: 'is a list such as [1, 2]' }
  }
}

/** The first field that can't be sent as it stands, with the problem; else the message. */
export function messageOf(fields: readonly Field[], inputs: Inputs): Read {
  const message: Record<string, unknown> = {}
  for (const field of fields) {
    const read = readInput(field, inputs[keyOf(field)] ?? inputOf(field, field.initial))
    if (!read.ok) return { ok: false, problem: `${field.name} ${read.problem}` }
    if (read.value !== undefined) place(message, field.path, read.value)
  }
  return { ok: true, value: message }
}

/** Put a value at a path of the message, making the objects on the way. */
export function place(target: Record<string, unknown>, path: readonly string[], value: unknown): void {
  let owner = target
  for (const key of path.slice(0, -1)) owner = (owner[key] ??= {}) as Record<string, unknown>
  const last = path.at(-1)
  if (last !== undefined) owner[last] = value
}
