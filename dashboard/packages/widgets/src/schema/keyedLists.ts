/** Lists that stand side by side in a message, with the names of their elements: the joints of an arm. */
import { isObject, type Field } from './jsonSchema'

/** Where messages keep the names: ours, and that of ROS. */
const NAMES = ['names', 'name'] as const
/** More than this nobody reads one by one. */
const MAX_ELEMENTS = 64
/** A list of numbers without names: a vector, if it is short. */
const MAX_VECTOR = 6

/** The names of an object's elements; null where it has none, or one twice. */
export function elementNames(message: unknown): readonly string[] | null {
  if (!isObject(message)) return null
  for (const key of NAMES) {
    const names: unknown = message[key]
    if (Array.isArray(names) && names.length > 0 && names.every((name) => typeof name === 'string')) {
      return new Set(names).size === names.length ? names : null
    }
  }
  return null
}

/** What an element of a list is called: by the names beside the list, else by its number in a short one. Null: not at all. */
export function elementKeys(owner: unknown, list: unknown): readonly string[] | null {
  if (!Array.isArray(list) || list.length === 0 || !list.every((value) => typeof value === 'number')) return null
  const names = elementNames(owner)
  if (names?.length === list.length) return names.slice(0, MAX_ELEMENTS)
  return list.length <= MAX_VECTOR ? list.map((_, index) => String(index)) : null
}

/** An element of a list by what {@link elementKeys} calls it. */
export function elementOf(owner: unknown, list: readonly unknown[], key: string): unknown {
  const names = elementNames(owner)
  if (names?.length === list.length) return list[names.indexOf(key)]
  return /^\d+$/.test(key) ? list[Number(key)] : undefined
}

/** The fields of a list's elements, with its unit. */
export function elementFields(field: Field, owner: unknown, list: unknown): Field[] {
  return (elementKeys(owner, list) ?? []).map((key) => ({
    path: [...field.path, key],
    name: elementNames(owner) === null ? `${field.name} ${key}` : key,
    kind: 'number',
    unit: field.unit,
    description: field.description,
  }))
}
