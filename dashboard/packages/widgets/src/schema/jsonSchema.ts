/** Reads the JSON Schema of a connector's messages: which fields there are, and in which units. */
import { plainText } from '@mosaic/client'

export type JsonSchema = Record<string, unknown>

export interface Field {
  /** Keys from the root of the message to the value. */
  path: readonly string[]
  name: string
  kind: 'number' | 'boolean' | 'string' | 'array'
  unit: string
  description: string
  /** What a message starts with, where the schema says: its default, else the one value or the first that it allows. */
  initial?: unknown
  /** The values that it allows, where the schema names them. */
  allowed?: readonly unknown[]
  /** The bounds of a number. */
  range?: NumberRange
  isInteger?: boolean
  /** It may be left out: it is null then, or what the schema says. */
  isOptional?: boolean
  /** The elements of this list are numbers. */
  holdsNumbers?: boolean
}

export interface NumberRange {
  minimum?: number
  maximum?: number
  /** It is more than this. */
  above?: number
  /** It is less than this. */
  below?: number
}

/** How deep messages are followed; a schema may refer to itself. */
const MAX_DEPTH = 4

export function fieldsOf(schema: JsonSchema | undefined): Field[] {
  return schema === undefined ? [] : collect(schema, schema, { path: [], isOptional: false })
}

/** True where every part of the messages ends in one of {@link fieldsOf}: none is free, or nested too deeply. */
export function isWhollyFields(schema: JsonSchema | undefined): boolean {
  return schema !== undefined && endsInFields(schema, schema, 0)
}

function endsInFields(node: JsonSchema, root: JsonSchema, depth: number): boolean {
  const children = Object.values(propertiesOf(resolved(node, root)))
  const isClosed = children.length > 0 && depth <= MAX_DEPTH
  return isClosed && children.every((child) => kindOf(resolved(child, root)) !== null || endsInFields(child, root, depth + 1))
}

/** True where the schema describes every one of the paths (`orientation.x`). */
export function hasPaths(schema: JsonSchema | undefined, paths: readonly string[]): boolean {
  return schema !== undefined && paths.every((path) => nodeAt(schema, path.split('.')) !== null)
}

function nodeAt(root: JsonSchema, path: readonly string[]): JsonSchema | null {
  let node: JsonSchema = resolved(root, root)
  for (const key of path) {
    const next = propertiesOf(node)[key]
    if (next === undefined) return null
    node = resolved(next, root)
  }
  return node
}

/** The paths of the objects that a message must have and of whose parts the schema names none. */
export function freeObjects(schema: JsonSchema | undefined): (readonly string[])[] {
  return schema === undefined ? [] : freeObjectsIn(schema, schema, [])
}

function freeObjectsIn(node: JsonSchema, root: JsonSchema, path: readonly string[]): (readonly string[])[] {
  const { required } = resolved(node, root)
  if (path.length > MAX_DEPTH || !Array.isArray(required)) return []
  return Object.entries(propertiesOf(resolved(node, root))).flatMap(([key, raw]) => {
    const [child, here] = [resolved(raw, root), [...path, key]]
    if (!required.includes(key) || mayBeLeftOut(raw) || child['type'] !== 'object') return []
    return Object.keys(propertiesOf(child)).length === 0 ? [here] : freeObjectsIn(child, root, here)
  })
}

interface Place {
  path: readonly string[]
  /** Some object on the way may be left out. */
  isOptional: boolean
  /** What the default of an object on the way says of it; null: it is left out. */
  given?: unknown
}

function collect(node: JsonSchema, root: JsonSchema, place: Place): Field[] {
  if (place.path.length > MAX_DEPTH) return []
  return Object.entries(propertiesOf(resolved(node, root))).flatMap(([key, raw]) => {
    const child = resolved(raw, root)
    const given = givenAt(place.given, key, raw['default'])
    const here = { path: [...place.path, key], isOptional: place.isOptional || mayBeLeftOut(raw), given }
    const kind = kindOf(child) ?? plainKind(given)
    if (kind === null) return collect(child, root, here)
    const field = fieldAt(here, key, kind, child)
    return [kind === 'array' && isNumber(child['items'], root) ? { ...field, holdsNumbers: true } : field]
  })
}

function givenAt(given: unknown, key: string, otherwise: unknown): unknown {
  if (given === null) return null
  return isObject(given) && given[key] !== undefined ? given[key] : otherwise
}

/** Of the default of what may be an object or something plainer. */
function plainKind(given: unknown): Field['kind'] | null {
  const type = typeof given
  return type === 'string' || type === 'number' || type === 'boolean' ? type : null
}

function isNumber(node: unknown, root: JsonSchema): boolean {
  return isObject(node) && kindOf(resolved(node, root)) === 'number'
}

function fieldAt({ path, isOptional, given }: Place, key: string, kind: Field['kind'], node: JsonSchema): Field {
  const field: Field = { path, name: nameOf(key), kind, unit: unitOf(node, key), description: plainText(text(node['description'])) }
  const initial = given === undefined ? initialOf(node) : given
  if (initial !== undefined) field.initial = initial
  if (Array.isArray(node['enum'])) field.allowed = node['enum']
  if (node['type'] === 'integer') field.isInteger = true
  if (isOptional) field.isOptional = true
  const range = rangeOf(node)
  if (Object.keys(range).length > 0) field.range = range
  return field
}

function mayBeLeftOut(node: JsonSchema): boolean {
  const branches = node['anyOf']
  return node['default'] !== undefined || (Array.isArray(branches) && branches.some((branch) => isObject(branch) && branch['type'] === 'null'))
}

function rangeOf(node: JsonSchema): NumberRange {
  const bounds = { minimum: node['minimum'], maximum: node['maximum'], above: node['exclusiveMinimum'], below: node['exclusiveMaximum'] }
  return Object.fromEntries(Object.entries(bounds).filter(([, bound]) => typeof bound === 'number'))
}

function initialOf(node: JsonSchema): unknown {
  if (node['default'] !== undefined) return node['default']
  const allowed = node['enum']
  return node['const'] ?? (Array.isArray(allowed) ? (allowed[0] as unknown) : undefined)
}

function kindOf(node: JsonSchema): Field['kind'] | null {
  switch (node['type']) {
    case 'number':
    case 'integer':
      return 'number'
    case 'boolean':
    case 'string':
    case 'array':
      return node['type']
    default:
      return null
  }
}

const FOLLOWED = ['$ref', 'anyOf', 'allOf']

/** Follows `$ref` and the first real branch of an optional (`anyOf` with null); keeps what stands beside them. */
function resolved(node: JsonSchema, root: JsonSchema): JsonSchema {
  const target = referred(node, root) ?? optional(node)
  if (target === null) return node
  const beside = Object.entries(node).filter(([key]) => !FOLLOWED.includes(key))
  return { ...resolved(target, root), ...Object.fromEntries(beside) }
}

function referred(node: JsonSchema, root: JsonSchema): JsonSchema | null {
  const reference = text(node['$ref'])
  if (!reference.startsWith('#/$defs/')) return null
  const definitions = root['$defs']
  return isObject(definitions) ? asSchema(definitions[reference.slice('#/$defs/'.length)]) : null
}

function optional(node: JsonSchema): JsonSchema | null {
  const branches = node['anyOf'] ?? node['allOf']
  if (!Array.isArray(branches)) return null
  return asSchema(branches.find((branch) => isObject(branch) && branch['type'] !== 'null'))
}

function propertiesOf(node: JsonSchema): Record<string, JsonSchema> {
  const properties = node['properties']
  if (!isObject(properties)) return {}
  return Object.fromEntries(Object.entries(properties).filter((entry): entry is [string, JsonSchema] => isObject(entry[1])))
}

function unitOf(node: JsonSchema, key: string): string {
  const unit = plainText(text(node['unit']))
  return unit === '' ? unitFromName(key) : (SYMBOLS[unit] ?? unit)
}

/** Units that schemas spell in letters. */
const SYMBOLS: Record<string, string> = { deg: '°', us: 'µs', 'm/s2': 'm/s²', degC: '°C', percent: '%' }

/** Units that names carry (`voltage_v`), for robots that announce none. */
const SUFFIXES: Record<string, string> = {
  percent: '%',
  v: 'V',
  a: 'A',
  w: 'W',
  wh: 'Wh',
  m: 'm',
  mm: 'mm',
  s: 's',
  ms: 'ms',
  us: 'µs',
  hz: 'Hz',
  rad: 'rad',
  deg: '°',
  mps: 'm/s',
  mps2: 'm/s²',
  radps: 'rad/s',
  celsius: '°C',
  c: '°C',
  bps: 'bit/s',
  bytes: 'B',
  mb: 'MB',
  mib: 'MiB',
  gb: 'GB',
  gib: 'GiB',
}

export function unitFromName(key: string): string {
  const words = key.split('_')
  return words.length > 1 ? (SUFFIXES[words.at(-1) ?? ''] ?? '') : ''
}

/** `voltage_v` as people read it: `Voltage`. */
export function nameOf(key: string): string {
  const words = plainText(key).split('_')
  if (unitFromName(key) !== '') words.pop()
  const name = words.join(' ')
  return name.charAt(0).toUpperCase() + name.slice(1)
}

export function isObject(value: unknown): value is Record<string, unknown> {
  return typeof value === 'object' && value !== null && !Array.isArray(value)
}

function asSchema(value: unknown): JsonSchema | null {
  return isObject(value) ? value : null
}

function text(value: unknown): string {
  return typeof value === 'string' ? value : ''
}
