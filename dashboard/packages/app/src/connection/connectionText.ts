/** What the connection badge says. */
import { reasonOf, type BulkLaneState, type ConnectionPhase, type ConnectionState } from '@mosaic/client'

export interface ConnectionText {
  tone: 'ok' | 'busy' | 'bad' | 'idle'
  text: string
  /** Why, where there is a reason; empty otherwise. */
  reason: string
  cure: string
  canRetry: boolean
}

const PHASES: Record<ConnectionPhase, Pick<ConnectionText, 'tone' | 'text' | 'canRetry'>> = {
  idle: { tone: 'idle', text: 'Not connected', canRetry: true },
  connecting: { tone: 'busy', text: 'Connecting', canRetry: false },
  connected: { tone: 'ok', text: 'Connected', canRetry: false },
  reconnecting: { tone: 'busy', text: 'Reconnecting', canRetry: true },
  failed: { tone: 'bad', text: 'Failed', canRetry: true },
  closed: { tone: 'idle', text: 'Closed', canRetry: true },
}

/** Nobody tells an original robot that a page was killed; it finds out by itself. */
const BUSY_CODE = 'signal.robot_busy'
const BUSY_CURE = 'A page that was killed may hold an original robot for up to 45 s.'

/** A robot that is known to be offline didn't fail, nor did one of which nobody knows. */
const OFFLINE = { tone: 'idle', text: 'Offline', canRetry: true } as const
const NO_SERVER = { tone: 'idle', text: 'No server', canRetry: true } as const

/** What the server says of the robot, while it is there. */
export interface KnownPresence {
  isOnline?: boolean | undefined
  isServerAway?: boolean
}

export function connectionText(state: ConnectionState, presence: KnownPresence = {}): ConnectionText {
  const known = reasonOf(state.code ?? '')
  return {
    ...(withoutRobot(state.phase, presence) ?? PHASES[state.phase]),
    reason: state.code === undefined ? '' : (state.message ?? known.sentence),
    cure: state.code === undefined ? '' : cureOf(state.code, state.phase),
  }
}

function withoutRobot(phase: ConnectionPhase, { isOnline, isServerAway }: KnownPresence): typeof OFFLINE | typeof NO_SERVER | null {
  // A connection begins with the server; one that was up may come back by itself.
  if (isServerAway === true && (phase === 'connecting' || phase === 'failed')) return NO_SERVER
  return isOnline === false && phase === 'failed' ? OFFLINE : null
}

function cureOf(code: string, phase: ConnectionPhase): string {
  const { cure } = reasonOf(code)
  if (code !== BUSY_CODE) return cure
  return `${cure} ${BUSY_CURE}${phase === 'failed' ? '' : ' This page keeps trying.'}`
}

/** `8 ms`; below ten with one decimal, because there it matters. */
export function formattedRoundTrip(roundTripMs: number | null): string {
  if (roundTripMs === null) return '– ms'
  return `${roundTripMs < 10 ? roundTripMs.toFixed(1) : Math.round(roundTripMs)} ms`
}

/** What the details say of the second connection, once bulk data wants one. */
export function bulkConnectionText({ phase, code }: BulkLaneState): string {
  switch (phase) {
    case 'none':
      return ''
    case 'connecting':
      return 'Bulk data: a connection of its own is being made.'
    case 'up':
      return 'Bulk data has a connection of its own.'
    case 'failed':
      return `Bulk data goes over the main connection; another one is tried again. ${reasonOf(code ?? '').sentence}`
  }
}
