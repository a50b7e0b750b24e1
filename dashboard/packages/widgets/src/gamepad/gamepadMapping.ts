/**
 * What the axes and buttons of a gamepad mean for the robot: pure, from a reading to a stick.
 * Whatever a broken gamepad reports, the result is a number between -1 and 1, and rest where there is doubt.
 */
import type { Stick } from './stick'

/** Ways to move that an axis can be given to; those of `Twist`: ahead, to the left, counter-clockwise. */
export type DriveAxis = 'forward' | 'sideways' | 'left'

export const DRIVE_AXES: readonly DriveAxis[] = ['forward', 'left', 'sideways']

export interface AxisMapping {
  /** Which axis of the gamepad; null: none. */
  axis: number | null
  /** Deflection that counts as rest, 0 to 0.9. */
  deadZone: number
  /** 1 is proportional; more makes small movements finer. */
  exponent: number
  /** Share of the robot's limit that full deflection means, 0 to 1. */
  scale: number
  isInverted: boolean
}

export interface GamepadMapping {
  axes: Record<DriveAxis, AxisMapping>
  /** Hold it to drive; null: no such button. */
  deadManButton: number | null
  /** False: the sticks drive by themselves. */
  needsDeadMan: boolean
  /** Stops the robot for everybody; null: no such button. */
  stopButton: number | null
}

/** What one look at a gamepad gives. */
export interface GamepadReading {
  axes: readonly number[]
  buttons: readonly { pressed: boolean; value: number }[]
}

export const AXIS_LIMITS = {
  deadZone: { least: 0, most: 0.9 },
  exponent: { least: 0.5, most: 4 },
  scale: { least: 0, most: 1 },
} as const

/** Worn sticks rest up to here. */
const DEAD_ZONE = 0.12
/** Between straight and square: fine around the middle without a numb feeling. */
const EXPONENT = 1.6
/** A trigger counts as pressed from here. */
const PRESSED_FROM = 0.5

const axis = (number: number | null, isInverted = true): AxisMapping => ({
  axis: number,
  deadZone: DEAD_ZONE,
  exponent: EXPONENT,
  scale: 1,
  isInverted,
})

/**
 * W3C's standard gamepad: the left stick drives, the right one turns, the left shoulder button is held,
 * the right button of the cluster (B, circle) stops. Up and left are negative there, ahead and counter-clockwise positive here.
 */
export const STANDARD_MAPPING: GamepadMapping = {
  axes: { forward: axis(1), left: axis(2), sideways: axis(null) },
  deadManButton: 4,
  needsDeadMan: true,
  stopButton: 1,
}

/** Of any other gamepad only the first stick is where one expects it; a person has to look before it drives. */
export const UNKNOWN_MAPPING: GamepadMapping = {
  axes: { forward: axis(1), left: axis(0), sideways: axis(null) },
  deadManButton: 0,
  needsDeadMan: true,
  stopButton: 1,
}

/** The deflection after inversion, dead zone, curve and scale. It starts at zero where the dead zone ends: no jump. */
export function shaped(value: number, { deadZone, exponent, scale, isInverted }: AxisMapping): number {
  if (!Number.isFinite(value)) return 0
  const length = Math.min(1, Math.abs(value))
  if (length <= deadZone) return 0
  const share = Math.pow((length - deadZone) / (1 - deadZone), exponent) * scale
  return Math.sign(value) * share * (isInverted ? -1 : 1)
}

/** Where the sticks point, whether or not they may drive. */
export function stickOfGamepad(reading: GamepadReading, mapping: GamepadMapping): Required<Stick> {
  const of = (way: DriveAxis): number => {
    const chosen = mapping.axes[way]
    return chosen.axis === null ? 0 : shaped(reading.axes[chosen.axis] ?? 0, chosen)
  }
  return { forward: of('forward'), left: of('left'), sideways: of('sideways') }
}

export function isPressed(reading: GamepadReading, button: number | null): boolean {
  const state = button === null ? undefined : reading.buttons[button]
  return state !== undefined && (state.pressed || state.value > PRESSED_FROM)
}

export function isAtRest(stick: Required<Stick>): boolean {
  return stick.forward === 0 && stick.left === 0 && stick.sideways === 0
}

const STANDARD_BUTTONS = [
  'A (✕)', 'B (○)', 'X (□)', 'Y (△)', 'left shoulder (LB)', 'right shoulder (RB)', 'left trigger (LT)', 'right trigger (RT)',
  'View', 'Menu', 'left stick', 'right stick', 'up', 'down', 'left', 'right', 'Home',
] // prettier-ignore

/** What a button is called, as people see it on the gamepad. */
export function buttonName(button: number, isStandard: boolean): string {
  return (isStandard ? STANDARD_BUTTONS[button] : undefined) ?? `button ${button}`
}

const STANDARD_AXES = ['left stick, sideways', 'left stick, up and down', 'right stick, sideways', 'right stick, up and down']

export function axisName(number: number, isStandard: boolean): string {
  return (isStandard ? STANDARD_AXES[number] : undefined) ?? `axis ${number}`
}
