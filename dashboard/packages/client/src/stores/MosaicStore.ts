import type { DataPort } from '../DataPort'
import { StoreCounters } from '../delivery/StoreCounters'
import { guarded, Listeners, Value, type Readable } from '../Readable'
import type { Gap, MessageInfo, RobotConnector, StoreState } from '../types'

export type StoreType = 'receivable' | 'sendable' | 'bidirectional' | 'media'
export type LifecycleEvent = 'before-connected' | 'after-connected' | 'after-disconnected' | 'after-connection-failed'

/**
 * The operator's side of one connector. It outlives connections: the robot's connection attaches its channels or
 * track when there is one and takes them away when it ends. Made and counted by `StoreManager`.
 *
 * The four `on…` methods are for subclasses; everybody else uses `subscribeLifecycle`.
 */
export abstract class MosaicStore {
  private readonly status = new Value<StoreState>({ phase: 'waiting' })
  private readonly lifecycle = new Listeners<[LifecycleEvent]>()

  private readonly lastGap = new Value<Gap | null>(null)

  constructor(readonly robotConnector: RobotConnector) {}

  /** Where the store stands; changes are told. */
  readonly state: Readable<StoreState> = this.status

  /** Messages that were lost across a reconnection, the latest loss; null: none. */
  readonly gap: Readable<Gap | null> = this.lastGap

  /** What it has received and sent since it was made. */
  readonly counters = new StoreCounters()

  abstract getStoreType(): StoreType

  getRobotConnector(): RobotConnector {
    return this.robotConnector
  }

  onBeforeConnected(): void {}
  onAfterConnected(): void {}
  onAfterDisconnected(): void {}
  onAfterConnectionFailed(): void {}

  /** Hear of the same four moments from outside; the result takes the listener away. */
  subscribeLifecycle(listener: (event: LifecycleEvent) => void): () => void {
    return this.lifecycle.add(listener)
  }

  /** Called by the connection before it is set up. */
  notifyBeforeConnected(): void {
    guarded(() => this.onBeforeConnected())
    this.lifecycle.tell('before-connected')
  }

  /** Called by the connection when all channels (or the track) of the connector are there. */
  notifyAfterConnected(): void {
    this.setState({ phase: 'open' })
    guarded(() => this.onAfterConnected())
    this.lifecycle.tell('after-connected')
  }

  /** Called by the connection when it is over, or this connector's channel closed. */
  notifyAfterDisconnected(why: Omit<StoreState, 'phase'> = {}): void {
    this.setState({ phase: 'closed', ...why })
    guarded(() => this.onAfterDisconnected())
    this.lifecycle.tell('after-disconnected')
  }

  /** Called by the connection when it was lost and is being made anew. */
  notifyInterrupted(why: Omit<StoreState, 'phase'> = {}): void {
    const wasOpen = this.status.get().phase === 'open'
    this.setState({ phase: 'reconnecting', ...why })
    if (!wasOpen) return
    guarded(() => this.onAfterDisconnected())
    this.lifecycle.tell('after-disconnected')
  }

  /** Called by the connection: messages are lost. */
  missed(gap: Gap): void {
    this.lastGap.set(gap)
  }

  /** Called by the connection when it could not be set up. */
  notifyAfterConnectionFailed(why: Omit<StoreState, 'phase'>): void {
    this.setState({ phase: 'closed', ...why })
    guarded(() => this.onAfterConnectionFailed())
    this.lifecycle.tell('after-connection-failed')
  }

  /** Called by the connection: no such connector, or (`waiting`) not known yet. */
  setState(state: StoreState): void {
    const now = this.status.get()
    const isSame = now.phase === state.phase && now.code === state.code && now.nearest === state.nearest
    if (!isSame || now.message !== state.message) this.status.set(state)
  }

  /** Called by the connection: these channels (already open) now carry the connector. */
  attach(_ports: readonly DataPort[]): void {}

  /** Called by the connection: the channels are gone. */
  detach(): void {}

  /** Called by the connection: `data` arrived on `port`. */
  receive(_data: ArrayBuffer, _info: MessageInfo, _port: DataPort): void {}
}
