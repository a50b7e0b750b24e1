/** What is known of one resource, and what the robot's answers do to it. Pure; `LeaseTable` knows when. */
import type { ControlMessages, LeaseReply, LeaseWaiting, PeerInfo } from '@mosaic/protocol'
import { whyOf, type ControlEvent, type Why } from '../words/views'

/** Until the robot tells its own. */
export const DEFAULT_EXPIRY_S = 2

type LeaseMessage = 'lease.request' | 'lease.release' | 'lease.keep'

export type LeaseEffect =
  | { [T in LeaseMessage]: { type: 'send'; message: T; data: ControlMessages[T] } }[LeaseMessage]
  | { type: 'tell'; event: ControlEvent }

export interface LeaseEntry {
  holder: PeerInfo | null
  queue: readonly LeaseWaiting[]
  expiryMs: number
  /** What I hold; `aliveAtMs`: when I last said so. */
  grant: { epoch: number; aliveAtMs: number } | null
  request: ({ phase: 'asked' | 'queued' } & Why) | null
  /** Held when the link was lost: by which peer of mine, and until when to ask again. */
  reclaim: { peerId: string | null; untilMs: number } | null
  ended: Why | null
  /** Releases that the robot has not confirmed: what it says before that was said to somebody who still wanted it. */
  releasing: { count: number; untilMs: number }
  /** Who is already known to wait for what I hold. */
  askers: ReadonlySet<string>
}

export function fresh(): LeaseEntry {
  return {
    holder: null,
    queue: [],
    expiryMs: DEFAULT_EXPIRY_S * 1000,
    grant: null,
    request: null,
    reclaim: null,
    ended: null,
    releasing: { count: 0, untilMs: 0 },
    askers: new Set(),
  }
}

/** Everything is older by this than the clock says. */
export function age({ grant, reclaim, releasing }: LeaseEntry, ms: number): void {
  if (grant) grant.aliveAtMs -= ms
  if (reclaim) reclaim.untilMs -= ms
  releasing.untilMs -= ms
}

/** A robot that does not confirm is taken at its word again after this long. */
const CONFIRMATION_MS = 2000

/** Forget everything that is held or wanted, and say so. */
export function released(resource: string, entry: LeaseEntry, nowMs: number): LeaseEffect[] {
  entry.grant = entry.request = entry.reclaim = entry.ended = null
  entry.releasing = { count: isReleasing(entry, nowMs) ? entry.releasing.count + 1 : 1, untilMs: nowMs + CONFIRMATION_MS }
  return [{ type: 'send', message: 'lease.release', data: { resource } }]
}

/** The robot answers each release with this, and a request that came later only afterwards. */
export function isConfirmation({ outcome, code }: LeaseReply): boolean {
  return (outcome === 'ended' && code === 'lease.released') || code === 'lease.unknown_resource'
}

export function isReleasing({ releasing }: LeaseEntry, nowMs: number): boolean {
  return releasing.count > 0 && nowMs < releasing.untilMs
}

// This page slept: the robot has long given the lease up, though its word may still be on the way.
export function isSilent({ grant, expiryMs }: LeaseEntry, nowMs: number): boolean {
  return grant !== null && nowMs - grant.aliveAtMs > expiryMs
}

export function isWanted({ grant, request }: LeaseEntry): boolean {
  return grant !== null || request !== null
}

export function granted({ resource, epoch }: LeaseReply, entry: LeaseEntry, nowMs: number): LeaseEffect[] {
  // 0 is the wire's word for "none".
  if (epoch === 0) return []
  const isNews = entry.grant?.epoch !== epoch
  if (isNews) entry.askers = new Set()
  entry.grant = { epoch, aliveAtMs: nowMs }
  entry.request = entry.reclaim = entry.ended = null
  return isNews ? [tell({ type: 'granted', resource })] : []
}

export function ended(reply: LeaseReply, entry: LeaseEntry): LeaseEffect[] {
  const { resource } = reply
  const why = whyOf(reply)
  const wasTold = entry.grant === null && entry.ended?.code !== 'lease.not_holder'
  entry.grant = null
  if (wasTold || why.code === 'lease.released') return []
  entry.ended = why
  return [tell({ type: 'lost', resource, ...why })]
}

export function expired(resource: string, entry: LeaseEntry): LeaseEffect[] {
  entry.grant = null
  entry.ended = { code: 'lease.expired' }
  return [tell({ type: 'lost', resource, code: 'lease.expired' })]
}

export function denied(reply: LeaseReply, entry: LeaseEntry): LeaseEffect[] {
  entry.request = null
  entry.ended = whyOf(reply)
  return [tell({ type: 'denied', resource: reply.resource, ...whyOf(reply) })]
}

export function tell(event: ControlEvent): LeaseEffect {
  return { type: 'tell', event }
}
