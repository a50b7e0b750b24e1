import type { DataPort } from '../delivery/DataPort'
import { guarded } from '../platform/Readable'
import type { MessageInfo } from '../words/types'
import { repeated } from './messageInfo'
import { MosaicStore, type StoreType } from './MosaicStore'

/** Given the bytes of a message, and what else is known of it. */
export type DataListener = (data: ArrayBuffer, info?: MessageInfo) => void | Promise<void>

/** Receives from one connector of the robot: whoever subscribes is given the bytes of every message. */
export class ReceivableStore extends MosaicStore {
  private readonly subscribers = new Set<{ listener: DataListener }>()
  private last: { data: ArrayBuffer; info: MessageInfo } | null = null

  getStoreType(): StoreType {
    return 'receivable'
  }

  /** The last message, for whoever comes later. */
  get latest(): { data: ArrayBuffer; info: MessageInfo } | null {
    return this.last
  }

  /** How many listen. */
  get subscriberCount(): number {
    return this.subscribers.size
  }

  /**
   * Be given every message from now on, and first the last one, if there was any (`info.latched` is true then).
   * The result takes the listener away.
   */
  subscribe(listener: DataListener): () => void {
    const entry = { listener }
    this.subscribers.add(entry)
    guarded(() => this.onSubscriberAdded())
    this.repeatLatest(entry)
    return () => {
      if (this.subscribers.delete(entry)) guarded(() => this.onSubscriberRemoved())
    }
  }

  /** Give a message to all subscribers; one that throws disturbs nobody else. */
  notifySubscribers(data: ArrayBuffer, info?: MessageInfo): void {
    if (info) this.last = { data, info }
    for (const entry of [...this.subscribers]) {
      if (this.subscribers.has(entry)) guarded(() => entry.listener(data, info))
    }
  }

  /** Overridden by a class that does something when somebody begins to listen. */
  onSubscriberAdded(): void {}
  /** Overridden by a class that does something when somebody stops listening. */
  onSubscriberRemoved(): void {}

  override receive(data: ArrayBuffer, info: MessageInfo, _port: DataPort): void {
    this.notifySubscribers(data, info)
  }

  // In a microtask, so that the caller holds its unsubscribe function before it is called.
  private repeatLatest(entry: { listener: DataListener }): void {
    const last = this.last
    if (last === null) return
    queueMicrotask(() => {
      if (this.last !== last || !this.subscribers.has(entry)) return
      guarded(() => entry.listener(last.data, repeated(last.info)))
    })
  }
}
