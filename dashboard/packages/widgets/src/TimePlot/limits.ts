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

/** A scale that shows less of its values than this share shows the farther limit no more. */
const LEAST_FILLED = 0.25

/** From the least to the greatest value that a scale shows: all values, the nearer limit, and the farther one where the
 *  values are not a flat line then. */
export function scaleRange(least: number | null, greatest: number | null, limits: readonly number[]): [number, number] {
  const values = [least, greatest].filter((value): value is number => value !== null && Number.isFinite(value))
  const whole = hull([...values, ...limits.filter(Number.isFinite)])
  const near = values.length === 0 ? whole : hull([...values, nearest(values, whole)])
  const [low, high] = width(near) < LEAST_FILLED * width(whole) ? near : whole
  return low === high ? [low - 0.5, high + 0.5] : [low, high]
}

function hull(numbers: readonly number[]): [number, number] {
  return numbers.length === 0 ? [0, 1] : [Math.min(...numbers), Math.max(...numbers)]
}

/** Which end of the scale is nearer to the values. */
function nearest(values: readonly number[], [low, high]: [number, number]): number {
  return Math.min(...values) - low <= high - Math.max(...values) ? low : high
}

function width([low, high]: [number, number]): number {
  return high - low
}
