/** Turns where a hold points into a velocity within the limits of the robot, purely: never anything but numbers. */
import type { messages } from '@mosaic/client'
import type { Stick } from '../gamepad/stick'

/** The Twist JSON that MOSAIC's robots take: m/s and rad/s, x forward, y left, z up (REP-103). */
export type Twist = messages.Twist

export interface DriveLimits {
  maxLinearMps: number
  maxAngularRadps: number
}

export type DriveKey = 'forward' | 'back' | 'left' | 'right'

export const ZERO_TWIST: Twist = { linear: { x: 0, y: 0, z: 0 }, angular: { x: 0, y: 0, z: 0 } }

/** What of a hold says where to. */
export interface Hold {
  readonly stick: Stick | null
  readonly keys: readonly DriveKey[]
  readonly gamepad: Stick | null
  /** Share of the limits that full deflection means, 0 to 1. */
  readonly speed: number
}

/** The velocity that the hold asks for, never above the limits. */
export function twistOf(hold: Hold, limits: DriveLimits): Twist {
  const { forward, left, sideways = 0 } = askedStick(hold)
  // Ahead and sideways together are one speed: the corner of a stick's square is not faster than its edge.
  const share = (hold.speed * limits.maxLinearMps) / Math.max(1, Math.hypot(forward, sideways))
  return {
    linear: { x: noNegativeZero(forward * share), y: noNegativeZero(sideways * share), z: 0 },
    angular: { x: 0, y: 0, z: noNegativeZero(left * hold.speed * limits.maxAngularRadps) },
  }
}

/** Where the hold points: a finger counts before keys, keys before a gamepad. */
export function askedStick(hold: Hold): Stick {
  return hold.stick ?? (hold.keys.length === 0 ? hold.gamepad : null) ?? stickOfKeys(hold.keys)
}

export function stickOfKeys(keys: readonly DriveKey[]): Stick {
  const on = (key: DriveKey) => (keys.includes(key) ? 1 : 0)
  return { forward: on('forward') - on('back'), left: on('left') - on('right') }
}

/** The limits that the robot announces; without any, 1 m/s and 1 rad/s, which is what MOSAIC's own pads send. */
export function limitsOf(safety: Record<string, unknown> | undefined): DriveLimits {
  return {
    maxLinearMps: positive(safety?.['max_linear_mps'], 1),
    maxAngularRadps: positive(safety?.['max_angular_radps'], 1),
  }
}

function positive(value: unknown, otherwise: number): number {
  return typeof value === 'number' && Number.isFinite(value) && value >= 0 ? value : otherwise
}

function noNegativeZero(value: number): number {
  return value === 0 ? 0 : value
}
