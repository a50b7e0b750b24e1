import { Value, type MessageInfo, type Refusal, type SendBlock, type StoreState } from '@mosaic/client'
import { act } from '@testing-library/react'
import type { AnyStore } from '../src/stores/storeKinds'

const INFO: MessageInfo = { receivedAtMs: 0, seq: 1, stampUs: 0, latched: false, ageMs: 0 }

/** A store that receives what a test says and keeps what the page sends. */
export class FakeStore {
  readonly state = new Value<StoreState>({ phase: 'open' })
  readonly lastRefusal = new Value<Refusal | null>(null)
  readonly sendBlocked = new Value<SendBlock | null>(null)
  readonly sent: unknown[] = []
  takes = true
  latest: { data: ArrayBuffer; info: MessageInfo } | null = null
  private readonly listeners = new Set<(data: ArrayBuffer, info?: MessageInfo) => void>()

  subscribe(listener: (data: ArrayBuffer, info?: MessageInfo) => void): () => void {
    this.listeners.add(listener)
    if (this.latest !== null) listener(this.latest.data, this.latest.info)
    return () => this.listeners.delete(listener)
  }

  sendData(data: string | object): boolean {
    if (this.takes) this.sent.push(typeof data === 'string' ? JSON.parse(data) : data)
    return this.takes
  }

  say(value: unknown, info: Partial<MessageInfo> = {}): void {
    this.latest = { data: new TextEncoder().encode(JSON.stringify(value)).buffer, info: { ...INFO, receivedAtMs: performance.timeOrigin + performance.now(), ...info } }
    act(() => this.listeners.forEach((listener) => this.latest && listener(this.latest.data, this.latest.info)))
  }

  get asStore(): AnyStore {
    return this as unknown as AnyStore
  }
}

/** A `StoreManager` that has these stores, by label. */
export function storesOf(stores: Readonly<Record<string, FakeStore>>): object {
  return { storeManager: { getOrCreateStore: ({ connectorId }: { connectorId: string }) => stores[connectorId], releaseStore: () => {} } }
}
