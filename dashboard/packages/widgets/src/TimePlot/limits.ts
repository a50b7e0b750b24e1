/** Finds the limits of a measurement among the fields of its message: `range_min` and `range_max` beside `range`. */
import type { Field } from '../schema/jsonSchema'

export interface Limited {
  field: Field
  min: Field
  max: Field
}

/** Both limits stand beside the field that they are of; one alone may be a value like any other. */
export function limitedFields(fields: readonly Field[]): Limited[] {
  const byKey = new Map(fields.map((field) => [keyOf(field), field]))
  return fields.flatMap((field) => {
    const min = byKey.get(`${keyOf(field)}_min`)
    const max = byKey.get(`${keyOf(field)}_max`)
    return min === undefined || max === undefined ? [] : [{ field, min, max }]
  })
}

/** What changes over time: all but the limits, which only say how far the scale goes. */
export function curvesOf(fields: readonly Field[]): readonly Field[] {
  const limits = new Set(limitedFields(fields).flatMap(({ min, max }) => [min, max]))
  return fields.filter((field) => !limits.has(field))
}

export function keyOf({ path }: Field): string {
  return path.join('.')
}

/** From the least to the greatest value that a scale shows: all values, and the limits where they are known. */
export function scaleRange(least: number | null, greatest: number | null, limits: readonly number[]): [number, number] {
  const known = [least, greatest, ...limits].filter((value): value is number => value !== null && Number.isFinite(value))
  if (known.length === 0) return [0, 1]
  const [low, high] = [Math.min(...known), Math.max(...known)]
  return low === high ? [low - 0.5, high + 0.5] : [low, high]
}
