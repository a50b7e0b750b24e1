/**
 * Reads plain JSON against the generated schemas the way the Python models do: unknown keys are dropped, defaults
 * filled in, nulls of optional keys left out; only types and sizes are strict.
 */
import { DEFINITIONS } from './generated'
import { plainText } from './plainText'

interface Schema {
  $ref?: string
  type?: string
  anyOf?: Schema[]
  enum?: unknown[]
  const?: unknown
  items?: Schema
  properties?: Record<string, Schema>
  required?: string[]
  additionalProperties?: Schema | boolean
  default?: unknown
  minimum?: number
  maximum?: number
  minLength?: number
  maxLength?: number
  pattern?: string
  /** `plain`: people read it, so that it may hold nothing that acts on a terminal or a page. */
  format?: string
}

/** Says which value does not fit first, by its path. */
export class Mismatch extends Error {
  override readonly name = 'Mismatch'
}

/** `value` as the definition `name` describes it, rebuilt from the keys that we know. */
export function validated(name: string, value: unknown): unknown {
  return read({ $ref: name }, value, '')
}

function read(schema: Schema, value: unknown, path: string): unknown {
  if (schema.$ref !== undefined) return readDefinition(schema.$ref, value, path)
  if (schema.anyOf) return readAny(schema.anyOf, value, path)
  if (schema.enum && !schema.enum.includes(value)) fail(path)
  if (schema.const !== undefined && schema.const !== value) fail(path)
  switch (schema.type) {
    case 'object':
      return readObject(schema, value, path)
    case 'array':
      if (!Array.isArray(value)) return fail(path)
      return value.map((entry, index) => read(schema.items ?? {}, entry, `${path}[${index}]`))
    case 'integer':
      return Number.isSafeInteger(value) && inRange(schema, value as number) ? value : fail(path)
    case 'number':
      return Number.isFinite(value) && inRange(schema, value as number) ? value : fail(path)
    case 'string':
      if (typeof value !== 'string' || !fits(schema, value)) return fail(path)
      return schema.format === 'plain' ? plainText(value) : value
    case 'boolean':
      return typeof value === 'boolean' ? value : fail(path)
    case 'null':
      return value === null ? value : fail(path)
    default:
      return value
  }
}

// What the Python models repair before they validate (`mode="before"` validators), which no JSON Schema tells.
const REPAIRS: Record<string, (fields: Record<string, unknown>) => Record<string, unknown>> = {
  IceServer: (fields) => (typeof fields.urls === 'string' ? { ...fields, urls: [fields.urls] } : fields),
  IceCandidate: (fields) => (fields.sdpMLineIndex === null ? { ...fields, sdpMLineIndex: 0 } : fields),
}

function readDefinition(name: string, value: unknown, path: string): unknown {
  const definition = DEFINITIONS[name] as Schema | undefined
  if (definition === undefined) throw new Error(`no definition ${name}`)
  const repair = REPAIRS[name]
  return read(definition, repair && isRecord(value) ? repair(value) : value, path)
}

function readAny(options: Schema[], value: unknown, path: string): unknown {
  for (const option of options) {
    try {
      return read(option, value, path)
    } catch (error) {
      if (!(error instanceof Mismatch)) throw error
    }
  }
  return fail(path)
}

function readObject(schema: Schema, value: unknown, path: string): unknown {
  if (!isRecord(value)) return fail(path)
  if (!schema.properties) return readDictionary(schema, value, path)
  const result: Record<string, unknown> = {}
  for (const [key, field] of Object.entries(schema.properties)) {
    const at = path === '' ? key : `${path}.${key}`
    const given = Object.hasOwn(value, key) ? value[key] : undefined
    if (given === undefined && schema.required?.includes(key)) fail(at)
    const read_ = given === undefined ? defaultOf(field) : read(field, given, at)
    if (read_ !== null && read_ !== undefined) result[key] = read_
  }
  return result
}

function readDictionary(schema: Schema, value: Record<string, unknown>, path: string): unknown {
  const entries = schema.additionalProperties
  if (typeof entries !== 'object') return value
  return Object.fromEntries(Object.entries(value).map(([key, entry]) => [key, read(entries, entry, `${path}.${key}`)]))
}

// A dictionary without a default in the schema is one that starts empty (`default_factory=dict`).
function defaultOf(field: Schema): unknown {
  return field.default === undefined && field.type === 'object' ? {} : field.default
}

function inRange(schema: Schema, value: number): boolean {
  return value >= (schema.minimum ?? -Infinity) && value <= (schema.maximum ?? Infinity)
}

function fits({ minLength = 0, maxLength = Infinity, pattern }: Schema, text: string): boolean {
  // Python counts code points, so do we.
  const length = Array.from(text).length
  return length >= minLength && length <= maxLength && (pattern === undefined || new RegExp(pattern, 'u').test(text))
}

function isRecord(value: unknown): value is Record<string, unknown> {
  return typeof value === 'object' && value !== null && !Array.isArray(value)
}

function fail(path: string): never {
  throw new Mismatch(path === '' ? 'data' : path)
}
