/**
 * What a held pad or key means for the robot: events in, the next state and the commands to send out.
 * Nothing moves unless somebody holds; whatever ends the hold sends a zero at once and needs a new press to move again.
 */

/** The Twist JSON that MOSAIC's robots take: m/s and rad/s, x forward, y left, z up (REP-103). */
export interface Twist {
  linear: Axes
  angular: Axes
}

export interface Axes {
  x: number
  y: number
  z: number
}

export interface DriveLimits {
  maxLinearMps: number
  maxAngularRadps: number
}

/** Which way, each from -1 to 1: `forward` ahead, `left` counter-clockwise. */
export interface Stick {
  forward: number
  left: number
}

export type DriveKey = 'forward' | 'back' | 'left' | 'right'

export type StopReason =
  | 'released'
  | 'stop-key'
  | 'blur'
  | 'hidden'
  | 'pagehide'
  | 'disconnected'
  | 'unmount'
  | 'pointercancel'
  | 'lostcapture'
  | 'late'

export interface DriveState {
  readonly enabled: boolean
  readonly stick: Stick | null
  readonly keys: readonly DriveKey[]
  /** Share of the limits that full deflection means, 0 to 1. */
  readonly speed: number
  readonly lastSentMs: number
  readonly zerosOwed: number
  readonly stoppedBy: StopReason | null
}

export type DriveEvent =
  | { type: 'enabled' }
  | { type: 'stick'; stick: Stick }
  | { type: 'keyDown'; key: DriveKey }
  | { type: 'keyUp'; key: DriveKey }
  | { type: 'stop'; reason: StopReason }
  | { type: 'speed'; speed: number }
  | { type: 'tick' }

export interface DriveStep {
  state: DriveState
  send: Twist | null
}

/** 20 commands a second: what upstream's robots and `timeout_s: 0.3` are made for. */
export const TICK_MS = 50
/** A tick this late means a throttled or frozen page: its operator no longer sees what the robot does. */
export const LATE_AFTER_MS = 250
/** Ticks that queued up while the page was busy must not leave as a burst. */
export const TOO_SOON_MS = TICK_MS / 2
/** A zero may be lost on an unreliable channel; for a quarter of a second it is repeated, then the pad is silent. */
export const ZEROS_AFTER_STOP = 5
/** Deflection that a resting thumb makes. */
export const DEAD_ZONE = 0.08
export const MIN_SPEED = 0.05

export const ZERO_TWIST: Twist = { linear: { x: 0, y: 0, z: 0 }, angular: { x: 0, y: 0, z: 0 } }

export const INITIAL_DRIVE: DriveState = {
  enabled: false,
  stick: null,
  keys: [],
  speed: 0.5,
  lastSentMs: 0,
  zerosOwed: 0,
  stoppedBy: null,
}

export function isHeld(state: DriveState): boolean {
  return state.stick !== null || state.keys.length > 0
}

/** True while ticks are needed: somebody holds, or zeros are still to be repeated. */
export function needsTicks(state: DriveState): boolean {
  return isHeld(state) || state.zerosOwed > 0
}

export function handleDrive(state: DriveState, event: DriveEvent, nowMs: number, limits: DriveLimits): DriveStep {
  switch (event.type) {
    case 'enabled':
      return quiet({ ...state, enabled: true })
    case 'stick':
      return held(state, { ...state, stick: limited(event.stick) }, nowMs, limits)
    case 'keyDown':
      return held(state, { ...state, keys: [...new Set([...state.keys, event.key])] }, nowMs, limits)
    case 'keyUp':
      return keyReleased(state, event.key)
    case 'stop':
      return stopped(state, event.reason)
    case 'speed':
      return quiet({ ...state, speed: clamp(event.speed, MIN_SPEED, 1) })
    case 'tick':
      return ticked(state, nowMs, limits)
  }
}

function quiet(state: DriveState): DriveStep {
  return { state, send: null }
}

/** The first moment of a hold is sent at once; what follows waits for the tick. */
function held(before: DriveState, after: DriveState, nowMs: number, limits: DriveLimits): DriveStep {
  if (!before.enabled) return quiet(before)
  const moving = { ...after, zerosOwed: 0, stoppedBy: null }
  if (isHeld(before)) return quiet(moving)
  return { state: { ...moving, lastSentMs: nowMs }, send: twistOf(moving, limits) }
}

function keyReleased(state: DriveState, key: DriveKey): DriveStep {
  if (!state.keys.includes(key)) return quiet(state)
  const keys = state.keys.filter((held) => held !== key)
  if (keys.length === 0 && state.stick === null) return stopped(state, 'released')
  return quiet({ ...state, keys })
}

function stopped(state: DriveState, reason: StopReason): DriveStep {
  const enabled = state.enabled && reason !== 'disconnected'
  if (!isHeld(state)) return quiet({ ...state, enabled })
  const zerosOwed = reason === 'disconnected' || reason === 'unmount' ? 0 : ZEROS_AFTER_STOP - 1
  return { state: { ...state, enabled, stick: null, keys: [], zerosOwed, stoppedBy: reason }, send: ZERO_TWIST }
}

function ticked(state: DriveState, nowMs: number, limits: DriveLimits): DriveStep {
  if (!isHeld(state)) {
    if (state.zerosOwed === 0) return quiet(state)
    return { state: { ...state, zerosOwed: state.zerosOwed - 1 }, send: ZERO_TWIST }
  }
  const gapMs = nowMs - state.lastSentMs
  if (gapMs > LATE_AFTER_MS) return stopped(state, 'late')
  if (gapMs < TOO_SOON_MS) return quiet(state)
  return { state: { ...state, lastSentMs: nowMs }, send: twistOf(state, limits) }
}

/** The velocity that the hold asks for, never above the limits. */
export function twistOf(state: DriveState, limits: DriveLimits): Twist {
  const { forward, left } = state.stick ?? stickOfKeys(state.keys)
  return {
    linear: { x: noNegativeZero(forward * state.speed * limits.maxLinearMps), y: 0, z: 0 },
    angular: { x: 0, y: 0, z: noNegativeZero(left * state.speed * limits.maxAngularRadps) },
  }
}

export function stickOfKeys(keys: readonly DriveKey[]): Stick {
  const on = (key: DriveKey) => (keys.includes(key) ? 1 : 0)
  return { forward: on('forward') - on('back'), left: on('left') - on('right') }
}

/** The stick inside the unit circle, with a dead zone; anything that is not a number counts as rest. */
export function limited(stick: Stick): Stick {
  const length = Math.hypot(stick.forward, stick.left)
  if (!Number.isFinite(length) || length < DEAD_ZONE) return { forward: 0, left: 0 }
  const scale = length > 1 ? 1 / length : 1
  return { forward: stick.forward * scale, left: stick.left * scale }
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

function clamp(value: number, low: number, high: number): number {
  return Number.isFinite(value) ? Math.min(high, Math.max(low, value)) : low
}

function noNegativeZero(value: number): number {
  return value === 0 ? 0 : value
}
