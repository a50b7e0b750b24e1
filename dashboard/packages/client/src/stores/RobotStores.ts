import { BidirectionalStore } from './BidirectionalStore'
import type { MosaicStore } from './MosaicStore'
import { SendableStore } from './SendableStore'

/** Keeps the stores of one robot by the label of their connector, and sends on them by that. */
export class RobotStores {
  private readonly stores = new Map<string, MosaicStore>()

  add(store: MosaicStore): void {
    this.stores.set(labelOf(store), store)
  }

  /** One that was replaced meanwhile is gone already. */
  remove(store: MosaicStore): void {
    if (this.stores.get(labelOf(store)) === store) this.stores.delete(labelOf(store))
  }

  /** Send it on this connector's channel; false where none is open, or it took nothing. */
  sendOn(label: string, text: string): boolean {
    const store = this.stores.get(label)
    return store !== undefined && isSending(store) && store.state.get().phase === 'open' && store.sendData(text)
  }

  /** Whether anything was sent to this connector. */
  hasSentOn(label: string): boolean {
    return (this.stores.get(label)?.counters.sent ?? 0) > 0
  }
}

export function isSending(store: MosaicStore): store is SendableStore | BidirectionalStore {
  return store instanceof SendableStore || store instanceof BidirectionalStore
}

export function labelOf(store: MosaicStore): string {
  return store.robotConnector.connectorId
}
