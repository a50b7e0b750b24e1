/** Joints: how they stand, where they may go, and where they shall. Pure. */
import { elementNames } from '../schema/keyedLists'
import { isObject } from '../schema/jsonSchema'

export interface Joint {
  name: string
  position: number | null
  velocity: number | null
  effort: number | null
}

/** Null for what tells of no joints. ROS has its lists in the singular. */
export function jointsOf(message: unknown): Joint[] | null {
  const names = elementNames(message)
  if (names === null || !isObject(message)) return null
  const positions = message['positions'] ?? message['position']
  const velocities = message['velocities'] ?? message['velocity']
  const efforts = message['efforts'] ?? message['effort']
  return names.map((name, index) => ({
    name,
    position: numberIn(positions, index),
    velocity: numberIn(velocities, index),
    effort: numberIn(efforts, index),
  }))
}

function numberIn(list: unknown, index: number): number | null {
  const value: unknown = Array.isArray(list) ? list[index] : null
  return typeof value === 'number' && Number.isFinite(value) ? value : null
}

export interface JointRange {
  min: number | null
  max: number | null
}

const ANY = '*'

/** The limits of one number of a command, as the catalogue has them: `positions.elbow`, `positions.*`, `position`. */
export function rangeOf(safety: Record<string, unknown> | undefined, field: string): JointRange {
  const limits = isObject(safety?.['limits']) ? safety['limits'] : {}
  const general = field.replace(/\.[^.]*$/, `.${ANY}`)
  const found = [limits[field], limits[general]].filter(isObject)
  return { min: said(found, 'min'), max: said(found, 'max') }
}

/** What a joint says itself, else what is said of all of them. */
function said(limits: readonly Record<string, unknown>[], key: string): number | null {
  return limits.map((limit) => limit[key]).find((value) => typeof value === 'number') ?? null
}

/** The names that the limits of a list have: joints that are known before any of them is seen. */
export function limitedNames(safety: Record<string, unknown> | undefined, list: string): string[] {
  const limits = isObject(safety?.['limits']) ? safety['limits'] : {}
  const prefix = `${list}.`
  return Object.keys(limits)
    .filter((field) => field.startsWith(prefix) && field !== `${prefix}${ANY}`)
    .map((field) => field.slice(prefix.length))
}

/** Half a turn to each side, where nothing is said; round, so that a slider stops at round numbers. */
const HALF_TURN = 3.15

/** The ends of a slider: the limits, else half a turn to each side; wide enough for where the joint stands. */
export function sliderRange({ min, max }: JointRange, position: number | null): { min: number; max: number } {
  const at = position ?? 0
  const low = min ?? Math.min(-HALF_TURN, at, (max ?? 0) - HALF_TURN)
  const high = max ?? Math.max(HALF_TURN, at, (min ?? 0) + HALF_TURN)
  return low <= high ? { min: low, max: high } : { min: high, max: low }
}

/** How far along its range a value lies, 0 to 1; null where the range has no two ends. */
export function shareOf(value: number | null, { min, max }: JointRange): number | null {
  if (value === null || min === null || max === null || max <= min) return null
  return Math.min(1, Math.max(0, (value - min) / (max - min)))
}

export function isOutside(value: number | null, { min, max }: JointRange): boolean {
  return value !== null && ((min !== null && value < min) || (max !== null && value > max))
}
