import type { CatalogueEntry, Peers, SafetyLimit, StopState } from '@mosaic/protocol'
import { Value } from '../platform/Readable'
import { resourceOf } from './clearance'
import type { Availability, LeaseView, PeerView, StopReport, StopView } from '../words/views'

const NO_STOP = { isStopped: false, by: '', reason: '' }

/** Holds what a `ControlDesk` shows. Objects keep their identity while they say the same, so that nobody draws in vain. */
export class DeskBoard {
  readonly availability = new Value<Availability>('unknown')
  readonly peers = new Value<readonly PeerView[]>([])
  readonly me = new Value<PeerView | null>(null)
  readonly leases = new Value<Readonly<Record<string, LeaseView>>>({})
  readonly stop = new Value<StopView>({ ...NO_STOP, mine: null })
  readonly limits = new Value<Readonly<Record<string, SafetyLimit>>>({})

  showPeers({ you, peers }: Peers): void {
    this.peers.set(peers.map((peer) => ({ ...peer, isMe: peer.peerId === you })))
    this.me.set(this.peers.get().find(({ isMe }) => isMe) ?? null)
  }

  showLeases(views: readonly LeaseView[]): void {
    const before = this.leases.get()
    const now = views.map((view) => unchanged(before[view.resource], view))
    const isNews = now.length !== Object.keys(before).length || now.some((view) => before[view.resource] !== view)
    if (isNews) this.leases.set(Object.fromEntries(now.map((view) => [view.resource, view])))
  }

  showStop(state: StopState): void {
    this.stop.set({ ...state, mine: this.stop.get().mine })
  }

  showMyStop(mine: StopReport | null): void {
    this.stop.set({ ...this.stop.get(), mine })
  }

  showLimit(limit: SafetyLimit): void {
    this.limits.set({ ...this.limits.get(), [limit.label]: limit })
  }

  /** The robot tells limits to whoever commands, and to nobody else. */
  forgetLimits(resource: string, entryOf: (label: string) => CatalogueEntry | null): void {
    const kept = Object.entries(this.limits.get()).filter(([label]) => resourceOf(entryOf(label)) !== resource)
    this.limits.set(Object.fromEntries(kept))
  }

  /** The link is gone: nothing is known but how my own stop went. */
  clear(): void {
    this.availability.set('unknown')
    this.peers.set([])
    this.me.set(null)
    this.limits.set({})
    this.stop.set({ ...NO_STOP, mine: this.stop.get().mine })
  }
}

function unchanged<T>(before: T | undefined, now: T): T {
  return before !== undefined && JSON.stringify(before) === JSON.stringify(now) ? before : now
}
