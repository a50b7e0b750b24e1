/**
 * Decides which leases are mine, purely: words of the robot and of the page in, messages and events out. Only the robot's
 * `granted` makes one mine; any sign to the contrary, silence included, ends it at once.
 */
import type { LeaseReply, LeaseState, LeaseWaiting } from '@mosaic/protocol'
import {
  age,
  DEFAULT_EXPIRY_S,
  denied,
  ended,
  expired,
  fresh,
  granted,
  isConfirmation,
  isReleasing,
  isSilent,
  isWanted,
  released,
  tell,
  type LeaseEffect,
  type LeaseEntry,
} from './leaseEntry'
import { whyOf, type LeaseView, type Why } from '../words/views'

/** A glance at another tab costs no lease; who stays away longer lets others drive. */
export const HIDDEN_GRACE_MS = 10_000
/** Whoever is back this soon is still at the same task; later, taking control is a new decision. */
export const RECLAIM_WITHIN_MS = 10_000

export type LeaseEvent =
  | { type: 'requested'; resource: string; reason: string; force: boolean }
  | { type: 'released'; resource: string }
  | { type: 'replied'; reply: LeaseReply }
  | { type: 'stateHeard'; state: LeaseState }
  /** A message of ours was not even considered, a request above all: too many of them. */
  | { type: 'refused'; why: Why }
  | { type: 'ticked' }
  /** The machine was asleep, and the clock stood still with it. */
  | { type: 'slept'; ms: number }
  | { type: 'visibilityChanged'; isVisible: boolean }
  /** `onPurpose`: this page said goodbye. */
  | { type: 'linkLost'; onPurpose: boolean }
  /** The connection won't come back by itself. */
  | { type: 'gaveUp'; why: Why }

export class LeaseTable {
  private readonly entries = new Map<string, LeaseEntry>()
  private hiddenSinceMs: number | null = null
  private peerId: string | null = null

  /** This connection's own id, once the robot has told it. */
  set me(peerId: string | null) {
    this.peerId = peerId
  }

  handle(event: LeaseEvent, nowMs: number): LeaseEffect[] {
    switch (event.type) {
      case 'requested':
        return this.requested(event)
      case 'released':
        return released(event.resource, this.entry(event.resource), nowMs)
      case 'replied':
        return this.replied(event.reply, nowMs)
      case 'stateHeard':
        return this.stateHeard(event.state)
      case 'refused':
        return this.refused(event.why, nowMs)
      case 'ticked':
        return this.ticked(nowMs)
      case 'slept':
        return this.slept(event.ms, nowMs)
      case 'visibilityChanged':
        this.hiddenSinceMs = event.isVisible ? null : (this.hiddenSinceMs ?? nowMs)
        return []
      case 'linkLost':
        return this.linkLost(event.onPurpose, nowMs)
      case 'gaveUp':
        return this.resources.flatMap(([resource, entry]) => this.reclaimFailed(resource, entry, event.why))
    }
  }

  /** The keep-alive has left this page. */
  kept(nowMs: number): void {
    for (const { grant } of this.entries.values()) if (grant) grant.aliveAtMs = nowMs
  }

  /** What a command for `resource` carries now; 0: none may leave. Holds even when nothing has ticked for long. */
  epochOf(resource: string, nowMs: number): number {
    const entry = this.entries.get(resource)
    return entry?.grant && !isSilent(entry, nowMs) ? entry.grant.epoch : 0
  }

  /** True while time matters: something is held, asked for, or about to be asked for again. */
  get needsTicks(): boolean {
    return this.resources.some(([, { grant, request, reclaim }]) => grant !== null || request !== null || reclaim !== null)
  }

  view(resource: string): LeaseView {
    const { holder, queue, grant, request, ended } = this.entries.get(resource) ?? fresh()
    const isMine = grant !== null
    const isOthers = holder !== null && holder.peerId !== this.peerId
    return {
      resource,
      state: isMine ? 'mine' : isOthers ? 'other' : 'free',
      holder: holder === null ? null : { ...holder, isMe: holder.peerId === this.peerId },
      isMine,
      epoch: grant?.epoch ?? 0,
      queue,
      request: request === null ? null : { ...request, place: this.placeIn(queue) },
      ended,
    }
  }

  get views(): LeaseView[] {
    return this.resources.map(([resource]) => this.view(resource))
  }

  private get resources(): [string, LeaseEntry][] {
    return [...this.entries]
  }

  private entry(resource: string): LeaseEntry {
    const entry = this.entries.get(resource) ?? fresh()
    this.entries.set(resource, entry)
    return entry
  }

  private placeIn(queue: readonly LeaseWaiting[]): number {
    return queue.findIndex(({ peerId }) => peerId === this.peerId) + 1
  }

  private requested({ resource, reason, force }: LeaseEvent & { type: 'requested' }): LeaseEffect[] {
    const entry = this.entry(resource)
    entry.request = { phase: 'asked', code: '' }
    entry.reclaim = null
    entry.ended = null
    return [{ type: 'send', message: 'lease.request', data: { resource, reason, force } }]
  }

  private replied(reply: LeaseReply, nowMs: number): LeaseEffect[] {
    const { resource, outcome } = reply
    const entry = this.entry(resource)
    if (isReleasing(entry, nowMs)) {
      if (isConfirmation(reply)) entry.releasing.count -= 1
      return []
    }
    if (outcome === 'granted') return isWanted(entry) ? granted(reply, entry, nowMs) : []
    if (outcome === 'ended') return ended(reply, entry)
    if (entry.reclaim) return this.reclaimRefused(reply, entry, nowMs)
    if (outcome === 'denied') return denied(reply, entry)
    if (entry.request) entry.request = { phase: 'queued', ...whyOf(reply) }
    return entry.request ? [tell({ type: 'queued', resource, ...whyOf(reply) })] : []
  }

  private refused(why: Why, nowMs: number): LeaseEffect[] {
    const asked = this.resources.filter(([, { request }]) => request?.phase === 'asked')
    const replies = asked.map(([resource]): LeaseReply => ({ resource, outcome: 'denied', epoch: 0, ...why }))
    return replies.flatMap((reply) => this.replied(reply, nowMs))
  }

  private stateHeard({ resource, epoch, holder, queue, expiryS }: LeaseState): LeaseEffect[] {
    const entry = this.entry(resource)
    entry.holder = holder ?? null
    entry.queue = queue
    entry.expiryMs = (expiryS > 0 ? expiryS : DEFAULT_EXPIRY_S) * 1000
    const isMine = holder !== undefined && holder.peerId === this.peerId
    if (entry.grant && isMine && epoch > 0) entry.grant.epoch = epoch
    if (entry.grant && !isMine) {
      entry.grant = null
      entry.ended ??= { code: 'lease.not_holder' }
    }
    // Neither next nor in the queue: the robot knows nothing of the request any more.
    if (entry.request?.phase === 'queued' && !isMine && this.placeIn(queue) === 0) entry.request = null
    return [...this.newAskers(resource, entry), ...this.reclaimed(resource, entry)]
  }

  private newAskers(resource: string, entry: LeaseEntry): LeaseEffect[] {
    if (!entry.grant) return []
    const known = entry.askers
    entry.askers = new Set(entry.queue.map(({ peerId }) => peerId))
    const news = entry.queue.filter(({ peerId }) => !known.has(peerId))
    return news.map((by) => tell({ type: 'asked', resource, by }))
  }

  // The link is back, and this is the first word of who commands: free, or still this session's?
  private reclaimed(resource: string, entry: LeaseEntry): LeaseEffect[] {
    const { reclaim, holder } = entry
    if (!reclaim || entry.request) return []
    const isStillOurs = holder === null || holder.peerId === reclaim.peerId || holder.peerId === this.peerId
    if (!isStillOurs) return this.reclaimFailed(resource, entry, { code: 'lease.expired' })
    entry.request = { phase: 'asked', code: '' }
    return [{ type: 'send', message: 'lease.request', data: { resource, reason: '', force: false } }]
  }

  // Somebody was faster. Nobody is bothered with a request that no person has made.
  private reclaimRefused({ resource, outcome }: LeaseReply, entry: LeaseEntry, nowMs: number): LeaseEffect[] {
    const why = { code: 'lease.expired' }
    if (outcome === 'denied') return this.reclaimFailed(resource, entry, why)
    const withdrawn = released(resource, entry, nowMs)
    entry.ended = why
    return [...withdrawn, tell({ type: 'lost', resource, ...why })]
  }

  private reclaimFailed(resource: string, entry: LeaseEntry, why: Why): LeaseEffect[] {
    if (!entry.reclaim) return []
    entry.reclaim = entry.request = null
    entry.ended = why
    return [tell({ type: 'lost', resource, ...why })]
  }

  private ticked(nowMs: number): LeaseEffect[] {
    const isAway = this.hiddenSinceMs !== null && nowMs - this.hiddenSinceMs >= HIDDEN_GRACE_MS
    const effects = this.resources.flatMap(([resource, entry]) => {
      if (entry.reclaim && nowMs >= entry.reclaim.untilMs) {
        return this.reclaimFailed(resource, entry, { code: 'lease.expired' })
      }
      if (entry.grant && isSilent(entry, nowMs)) return expired(resource, entry)
      return isAway && (entry.grant || entry.request) ? this.leftAlone(resource, entry, nowMs) : []
    })
    return [...effects, ...this.keep()]
  }

  private slept(ms: number, nowMs: number): LeaseEffect[] {
    for (const entry of this.entries.values()) age(entry, ms)
    if (this.hiddenSinceMs !== null) this.hiddenSinceMs -= ms
    return this.ticked(nowMs)
  }

  private keep(): LeaseEffect[] {
    const epochs: Record<string, number> = {}
    for (const [resource, { grant }] of this.entries) {
      if (grant) epochs[resource] = grant.epoch
    }
    if (Object.keys(epochs).length === 0) return []
    return [{ type: 'send', message: 'lease.keep', data: { epochs } }]
  }

  private leftAlone(resource: string, entry: LeaseEntry, nowMs: number): LeaseEffect[] {
    const why = { code: 'lease.released', message: `the page was hidden for ${HIDDEN_GRACE_MS / 1000} s` }
    const wasMine = entry.grant !== null
    const effects = released(resource, entry, nowMs)
    entry.ended = why
    return wasMine ? [...effects, tell({ type: 'lost', resource, ...why })] : effects
  }

  private linkLost(onPurpose: boolean, nowMs: number): LeaseEffect[] {
    const effects = this.resources.flatMap(([resource, entry]) => {
      const lost = entry.grant && isSilent(entry, nowMs) ? expired(resource, entry) : []
      if (onPurpose) entry.reclaim = null
      else if (entry.grant) entry.reclaim = { peerId: this.peerId, untilMs: nowMs + RECLAIM_WITHIN_MS }
      else if (entry.request && !entry.reclaim) entry.ended = { code: 'peer.lost' }
      entry.grant = entry.request = entry.holder = null
      entry.queue = []
      entry.releasing.count = 0
      return onPurpose ? [] : lost
    })
    this.peerId = null
    return effects
  }
}
