/** A message as text: one to start from, and what was typed, checked. */
import { fieldsOf, freeObjects, type Field, type JsonSchema } from '../schema/jsonSchema'
import { place } from './messageForm'

const EMPTY: Record<Field['kind'], unknown> = { number: 0, boolean: false, string: '', array: [] }

/** A message to start from, made of the schema: its defaults, else zeros, empty strings and empty objects. */
export function templateOf(schema: JsonSchema | undefined): string {
  const message: Record<string, unknown> = {}
  for (const field of fieldsOf(schema)) {
    const isPartOfNothing = field.path.length > 1 && field.initial === null
    if (!isPartOfNothing) place(message, field.path, field.initial === undefined ? EMPTY[field.kind] : field.initial)
  }
  for (const path of freeObjects(schema)) place(message, path, {})
  return JSON.stringify(message, null, 2)
}

/** Whether zeros stand in it for numbers that a message must have and of which the schema says nothing. */
export function unsaidNumbers(schema: JsonSchema | undefined): boolean {
  return fieldsOf(schema).some((field) => field.kind === 'number' && field.initial === undefined && field.isOptional !== true)
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
