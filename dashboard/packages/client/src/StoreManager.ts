import type { CatalogueEntry } from '@mosaic/protocol'
import { nowMs } from './clock'
import { LingerCount } from './lingerCount'
import { BidirectionalStore } from './stores/BidirectionalStore'
import { ConnectionCheckingStore } from './stores/ConnectionCheckingStore'
import { MediaStreamStore } from './stores/MediaStreamStore'
import type { MosaicStore } from './stores/MosaicStore'
import { ReceivableStore } from './stores/ReceivableStore'
import { SendableStore } from './stores/SendableStore'
import { TalkStore } from './stores/TalkStore'
import type { RobotConnector } from './types'

/** How long an unused store keeps its channel. */
export const LINGER_MS = 1000

/** The robot's side of the manager: who gives stores their channels. */
export interface StoreHost {
  /** What the robot's catalogue says of this label; null while unknown. */
  entryOf(label: string): CatalogueEntry | null
  addStore(store: MosaicStore): void
  removeStore(store: MosaicStore): void
}

/** Makes one store per connector and counts its users; an unused store lingers for a second. */
export class StoreManager {
  private readonly stores = new Map<string, MosaicStore>()
  private readonly counts = new LingerCount<string>(LINGER_MS)
  private timer: ReturnType<typeof setTimeout> | null = null

  constructor(
    private readonly hostOf: (robotId: string) => StoreHost,
    private readonly now: () => number = nowMs,
  ) {}

  /**
   * The store of this connector; every call counts and asks for one `releaseStore`. Its class follows from
   * `dataType`, or from the robot's catalogue where that knows the label.
   */
  getOrCreateStore(connector: RobotConnector): MosaicStore {
    const key = keyOf(connector)
    const isNew = this.counts.retain(key)
    const existing = this.stores.get(key)
    if (!isNew && existing) return existing
    const host = this.hostOf(connector.robotId)
    const store = storeFor(connector, host.entryOf(connector.connectorId))
    this.stores.set(key, store)
    host.addStore(store)
    return store
  }

  /** The counterpart of `getOrCreateStore`. The last release closes the store's channels after a second. */
  releaseStore(connector: RobotConnector): void {
    if (this.counts.release(keyOf(connector), this.now())) this.schedule()
  }

  private schedule(): void {
    const atMs = this.counts.nextExpiryMs()
    if (atMs === null || this.timer !== null) return
    this.timer = setTimeout(() => this.sweep(), Math.max(0, atMs - this.now()))
  }

  private sweep(): void {
    this.timer = null
    for (const key of this.counts.expired(this.now())) {
      const store = this.stores.get(key)
      this.stores.delete(key)
      if (store) this.hostOf(store.robotConnector.robotId).removeStore(store)
    }
    this.schedule()
  }
}

function keyOf(connector: RobotConnector): string {
  return JSON.stringify([connector.robotId, connector.connectorId])
}

function storeFor(connector: RobotConnector, entry: CatalogueEntry | null): MosaicStore {
  if (entry?.type === 'connection-check') return new ConnectionCheckingStore(connector)
  const dataType = connector.dataType ?? entry?.dataType
  if (dataType === 'media' && entry?.kind === 'audio' && entry.direction === 'to-robot') return new TalkStore(connector)
  if (dataType === 'media') return new MediaStreamStore(connector)
  if (dataType?.endsWith('r2u')) return new ReceivableStore(connector)
  if (dataType?.endsWith('u2r')) return new SendableStore(connector)
  // Neither the caller nor the robot said: what can do both serves both.
  return new BidirectionalStore(connector)
}
