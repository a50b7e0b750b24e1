/** A gamepad's mapping, remembered in this browser per kind of gamepad; whatever the storage holds, the result is valid. */
import { AXIS_LIMITS, DRIVE_AXES, STANDARD_MAPPING, UNKNOWN_MAPPING, type AxisMapping, type DriveAxis, type GamepadMapping } from './gamepadMapping'

export interface MappingStorage {
  getItem(key: string): string | null
  setItem(key: string, value: string): void
  removeItem(key: string): void
}

export interface GamepadKind {
  id: string
  /** `standard` where the browser knows which axis is which. */
  mapping: string
}

export interface KnownMapping {
  mapping: GamepadMapping
  /** False for a gamepad that nobody has looked at and whose axes the browser does not know: it does not drive. */
  isTrusted: boolean
}

const keyOf = (id: string) => `mosaic.gamepad.${id}`

export function defaultMapping(kind: GamepadKind): GamepadMapping {
  return kind.mapping === 'standard' ? STANDARD_MAPPING : UNKNOWN_MAPPING
}

export function readMapping(storage: MappingStorage, kind: GamepadKind): KnownMapping {
  const otherwise = defaultMapping(kind)
  try {
    const text = storage.getItem(keyOf(kind.id))
    if (text !== null) return { mapping: validMapping(JSON.parse(text) as unknown, otherwise), isTrusted: true }
  } catch {
    // Forbidden storage or somebody else's text: as if there were none.
  }
  return { mapping: otherwise, isTrusted: kind.mapping === 'standard' }
}

/** Returns whether it could be kept. */
export function writeMapping(storage: MappingStorage, kind: GamepadKind, mapping: GamepadMapping): boolean {
  try {
    storage.setItem(keyOf(kind.id), JSON.stringify(mapping))
    return true
  } catch {
    return false
  }
}

export function forgetMapping(storage: MappingStorage, kind: GamepadKind): void {
  try {
    storage.removeItem(keyOf(kind.id))
  } catch {
    // Nothing was kept there either.
  }
}

/** A mapping from anything: what does not fit is taken from `otherwise`. */
export function validMapping(value: unknown, otherwise: GamepadMapping): GamepadMapping {
  const given = recordOf(value)
  const axes = recordOf(given['axes'])
  const axisOf = (way: DriveAxis): AxisMapping => validAxis(axes[way], otherwise.axes[way])
  const deadManButton = indexOf(given['deadManButton'], otherwise.deadManButton)
  const needsDeadMan = given['needsDeadMan'] !== false
  return {
    axes: Object.fromEntries(DRIVE_AXES.map((way) => [way, axisOf(way)])) as Record<DriveAxis, AxisMapping>,
    // Needed but not chosen would be a gamepad that never drives: that is safe, and the editor says so.
    deadManButton,
    needsDeadMan,
    stopButton: indexOf(given['stopButton'], otherwise.stopButton),
  }
}

function validAxis(value: unknown, otherwise: AxisMapping): AxisMapping {
  const given = recordOf(value)
  const within = (name: keyof typeof AXIS_LIMITS): number => {
    const number = given[name]
    const { least, most } = AXIS_LIMITS[name]
    return typeof number === 'number' && Number.isFinite(number) ? Math.min(most, Math.max(least, number)) : otherwise[name]
  }
  return {
    axis: indexOf(given['axis'], otherwise.axis),
    deadZone: within('deadZone'),
    exponent: within('exponent'),
    scale: within('scale'),
    isInverted: typeof given['isInverted'] === 'boolean' ? given['isInverted'] : otherwise.isInverted,
  }
}

function indexOf(value: unknown, otherwise: number | null): number | null {
  if (value === null) return null
  return Number.isInteger(value) && (value as number) >= 0 && (value as number) < 64 ? (value as number) : otherwise
}

function recordOf(value: unknown): Record<string, unknown> {
  return typeof value === 'object' && value !== null ? (value as Record<string, unknown>) : {}
}

/** `Xbox 360 Controller` of `Xbox 360 Controller (STANDARD GAMEPAD Vendor: 045e Product: 028e)` or `045e-028e-Xbox …`. */
export function gamepadName(id: string): string {
  const name = id.replace(/\s*\([^)]*(vendor|standard gamepad)[^)]*\)\s*$/i, '').replace(/^[0-9a-f]{1,4}-[0-9a-f]{1,4}-/i, '').trim()
  return name === '' ? 'Gamepad' : name
}
