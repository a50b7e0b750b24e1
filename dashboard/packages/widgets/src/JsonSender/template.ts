/** A message to start from, made of the schema: its defaults, else zeros and empty strings. */
import { fieldsOf, isObject, type Field, type JsonSchema } from '../schema/jsonSchema'

const EMPTY: Record<Field['kind'], unknown> = { number: 0, boolean: false, string: '', array: [] }

export function templateOf(schema: JsonSchema | undefined): string {
  const message: Record<string, unknown> = {}
  for (const field of fieldsOf(schema)) place(message, field.path, field.initial === undefined ? EMPTY[field.kind] : field.initial)
  return JSON.stringify(message, null, 2)
}

function place(target: Record<string, unknown>, [key, ...rest]: readonly string[], value: unknown): void {
  if (key === undefined) return
  if (rest.length === 0) {
    target[key] = value
    return
  }
  const child = isObject(target[key]) ? target[key] : {}
  target[key] = child
  place(child, rest, value)
}

export type Checked = { ok: true; text: string } | { ok: false; problem: string }

/** The text as it will be sent, or what is wrong with it. */
export function checkedJson(text: string): Checked {
  try {
    return { ok: true, text: JSON.stringify(JSON.parse(text)) }
  } catch (error) {
    return { ok: false, problem: error instanceof Error ? error.message : 'not JSON' }
  }
}
