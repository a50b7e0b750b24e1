/**
 * What a held pad, key or gamepad means for the robot: events in, the next state and the commands to send out.
 * Nothing moves unless somebody holds and this page commands; whatever ends the hold sends a zero at once and needs a
 * new press to move again.
 */
import { bounded, clamp, limited, type Stick } from '../gamepad/stick'
import { twistOf, ZERO_TWIST, type DriveKey, type DriveLimits, type Hold, type Twist } from './driveTwist'

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
  | 'unplugged'
  | 'escape'
  | 'stop-button'
  | EndOfPermit

/** The robot takes nothing more from this page: there is no use in a zero, the robot made itself safe. */
type Silenced = 'lease-lost' | 'robot-stopped' | 'not-granted'

/** `out-of-sight`: the page itself ends the hold, and the robot is told. */
export type EndOfPermit = Silenced | 'out-of-sight'

/** `free`: nobody commands, a touch asks for the lease; `refused`: somebody else commands, or this page may not. */
export type DrivePermit = 'granted' | 'free' | 'refused'

export interface DriveState extends Hold {
  readonly enabled: boolean
  readonly permit: DrivePermit
  /** Why the permit is refused; null while it is not. */
  readonly refusedBy: EndOfPermit | null
  /** Since when a hold has waited for the lease; null while none does. */
  readonly askedMs: number | null
  readonly lastSentMs: number
  readonly zerosOwed: number
  readonly stoppedBy: StopReason | null
}

export type DriveEvent =
  | { type: 'enabled' }
  | { type: 'stick'; stick: Stick }
  | { type: 'keyDown'; key: DriveKey }
  | { type: 'keyUp'; key: DriveKey }
  | { type: 'gamepad'; stick: Stick }
  | { type: 'gamepadReleased' }
  | { type: 'permit'; permit: DrivePermit; reason: EndOfPermit }
  | { type: 'stop'; reason: StopReason }
  | { type: 'speed'; speed: number }
  | { type: 'tick' }

export interface DriveStep {
  state: DriveState
  send: Twist | null
  /** True where the lease is to be asked for. */
  takesLease: boolean
}

/** 20 commands a second: what upstream's robots and `timeout_s: 0.3` are made for. */
export const TICK_MS = 50
/** A tick this late means a throttled or frozen page: its operator no longer sees what the robot does. */
export const LATE_AFTER_MS = 250
/** Ticks that queued up while the page was busy must not leave as a burst. */
export const TOO_SOON_MS = TICK_MS / 2
/** A zero may be lost on an unreliable channel; for a second it is repeated, then the pad is silent: autonomy may drive. */
export const ZEROS_AFTER_STOP = 1000 / TICK_MS
/** A robot that grants answers within a round trip; nobody should be surprised by motion long after the touch. */
export const GRANT_WITHIN_MS = 2000
export const MIN_SPEED = 0.05

export const INITIAL_DRIVE: DriveState = {
  enabled: false,
  permit: 'granted',
  refusedBy: null,
  askedMs: null,
  stick: null,
  keys: [],
  gamepad: null,
  speed: 0.5,
  lastSentMs: 0,
  zerosOwed: 0,
  stoppedBy: null,
}

export function isHeld(state: DriveState): boolean {
  return state.stick !== null || state.keys.length > 0 || state.gamepad !== null
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
      return released(state, { ...state, keys: state.keys.filter((key) => key !== event.key) })
    case 'gamepad':
      return held(state, { ...state, gamepad: bounded(event.stick) }, nowMs, limits)
    case 'gamepadReleased':
      return released(state, { ...state, gamepad: null })
    case 'permit':
      return permitted(state, event.permit, event.reason, nowMs, limits)
    case 'stop':
      return stopped(state, event.reason)
    case 'speed':
      return quiet({ ...state, speed: clamp(event.speed, MIN_SPEED, 1) })
    case 'tick':
      return ticked(state, nowMs, limits)
  }
}

function quiet(state: DriveState): DriveStep {
  return { state, send: null, takesLease: false }
}

function sending(state: DriveState, send: Twist): DriveStep {
  return { state, send, takesLease: false }
}

/** The first moment of a hold is sent at once, or asks for the lease; what follows waits for the tick. */
function held(before: DriveState, after: DriveState, nowMs: number, limits: DriveLimits): DriveStep {
  if (!before.enabled || before.permit === 'refused') return quiet(before)
  const moving = { ...after, zerosOwed: 0, stoppedBy: null }
  if (isHeld(before)) return quiet(moving)
  if (before.permit === 'free') return { state: { ...moving, askedMs: nowMs }, send: null, takesLease: true }
  return sending({ ...moving, lastSentMs: nowMs }, twistOf(moving, limits))
}

function released(before: DriveState, after: DriveState): DriveStep {
  if (!isHeld(before)) return quiet(before)
  return isHeld(after) ? quiet(after) : stopped(before, 'released')
}

function permitted(before: DriveState, permit: DrivePermit, reason: EndOfPermit, nowMs: number, limits: DriveLimits): DriveStep {
  const state = withRefusal(before, permit === 'refused' ? reason : null)
  if (permit === state.permit) return quiet(state)
  const now = { ...state, permit }
  if (permit !== 'granted') {
    // A hold that asked still waits while the robot has given the lease to nobody.
    return state.permit === 'granted' || permit === 'refused' ? stopped(now, reason) : quiet(now)
  }
  if (!isHeld(state)) return quiet(now)
  return sending({ ...now, askedMs: null, lastSentMs: nowMs }, twistOf(now, limits))
}

/** With the stop of the robot goes the word on what stopped the pad: it would read as if the robot still were. */
function withRefusal(state: DriveState, refusedBy: EndOfPermit | null): DriveState {
  const isCleared = state.refusedBy === 'robot-stopped' && refusedBy !== 'robot-stopped'
  return { ...state, refusedBy, stoppedBy: isCleared ? null : state.stoppedBy }
}

const SILENT: readonly StopReason[] = ['disconnected', 'lease-lost', 'robot-stopped', 'not-granted']

function stopped(state: DriveState, reason: StopReason): DriveStep {
  const enabled = state.enabled && reason !== 'disconnected'
  const isSilent = SILENT.includes(reason)
  // A robot that knows no stop is stopped by zeros, also where nobody holds: it may be moving all the same.
  const isStopButton = reason === 'stop-button' && enabled && state.permit === 'granted'
  if (!isHeld(state) && !isStopButton) return quiet({ ...state, enabled, zerosOwed: isSilent ? 0 : state.zerosOwed })
  const ended = { ...state, enabled, stick: null, keys: [], gamepad: null, askedMs: null, zerosOwed: 0, stoppedBy: reason }
  // Nothing of this hold ever left: there is nothing to end.
  if (state.askedMs !== null || (isSilent && reason !== 'disconnected')) return quiet(ended)
  const zerosOwed = isSilent || reason === 'unmount' ? 0 : ZEROS_AFTER_STOP - 1
  return sending({ ...ended, zerosOwed }, ZERO_TWIST)
}

function ticked(state: DriveState, nowMs: number, limits: DriveLimits): DriveStep {
  if (!isHeld(state)) {
    if (state.zerosOwed === 0) return quiet(state)
    return sending({ ...state, zerosOwed: state.zerosOwed - 1 }, ZERO_TWIST)
  }
  if (state.askedMs !== null) return nowMs - state.askedMs > GRANT_WITHIN_MS ? stopped(state, 'not-granted') : quiet(state)
  const gapMs = nowMs - state.lastSentMs
  if (gapMs > LATE_AFTER_MS) return stopped(state, 'late')
  if (gapMs < TOO_SOON_MS) return quiet(state)
  return sending({ ...state, lastSentMs: nowMs }, twistOf(state, limits))
}
