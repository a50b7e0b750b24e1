import type { ChannelEntry, MosaicDataType } from '@mosaic/protocol'
import type { DataPort } from '../delivery/DataPort'
import { StoreCounters } from '../delivery/StoreCounters'
import { guarded, Listeners, Value, type Readable } from '../platform/Readable'
import type { Gap, MessageInfo, RobotConnector, StoreState } from '../words/types'

/** Which way a store's data goes; `media`: pictures, sound or a voice. */
export type StoreType = 'receivable' | 'sendable' | 'bidirectional' | 'media'
/** The four moments of a store's connection. */
export type LifecycleEvent = 'before-connected' | 'after-connected' | 'after-disconnected' | 'after-connection-failed'
/** Told of one of the four moments; `state` is where the store stands then, with the reason if there is one. */
export type ConnectionListener = (state: StoreState) => unknown

/** What a robot without a catalogue is asked for, where nobody named the data type. */
const BARE_TYPES: Record<StoreType, MosaicDataType> = {
  receivable: 'json-r2u',
  sendable: 'json-u2r',
  bidirectional: 'json-bi',
  media: 'media',
}

/**
 * Represents one connector on the operator's side. It outlives connections: the robot's connection attaches its channels or
 * track when there is one and takes them away when it ends. Made and counted by `StoreManager`.
 *
 * Of each moment of its connection a subclass hears by overriding `afterConnected` and its kin, everybody else by
 * subscribing with `onAfterConnected` and its kin.
 */
export abstract class MosaicStore {
  private readonly status = new Value<StoreState>({ phase: 'waiting' })
  private readonly lifecycle = new Listeners<[LifecycleEvent]>()

  private readonly lastGap = new Value<Gap | null>(null)

  constructor(
    /** The connector that it serves. */
    readonly robotConnector: RobotConnector,
  ) {}

  /** Where the store stands; changes are told. */
  readonly state: Readable<StoreState> = this.status

  /** Messages that were lost across a reconnection, the latest loss; null: none. */
  readonly gap: Readable<Gap | null> = this.lastGap

  /** What it has received and sent since it was made. */
  readonly counters = new StoreCounters()

  /** Which way its data goes. */
  abstract getStoreType(): StoreType

  /** The connector that it serves. */
  getRobotConnector(): RobotConnector {
    return this.robotConnector
  }

  /** Overridden by a class that prepares something while its connection is made. */
  protected beforeConnected(): void {}
  /** Overridden by a class that does something once it can send and receive. */
  protected afterConnected(): void {}
  /** Overridden by a class that does something when its connection is gone, also if it is made anew. */
  protected afterDisconnected(): void {}
  /** Overridden by a class that does something when no connection could be made. */
  protected afterConnectionFailed(): void {}

  /** Subscribe to the moment before a connection is set up; the result takes the listener away. */
  onBeforeConnected(listener: ConnectionListener): () => void {
    return this.listenTo('before-connected', listener)
  }

  /**
   * Subscribe to the moment when the store can send and receive; the result takes the listener away. A store that is
   * open already tells of its next connection: `state` says where it stands now.
   */
  onAfterConnected(listener: ConnectionListener): () => void {
    return this.listenTo('after-connected', listener)
  }

  /** Subscribe to the moment when the connection is gone, also if it is made anew; the result takes the listener away. */
  onAfterDisconnected(listener: ConnectionListener): () => void {
    return this.listenTo('after-disconnected', listener)
  }

  /** Subscribe to the moment when no connection could be made; the result takes the listener away. */
  onAfterConnectionFailed(listener: ConnectionListener): () => void {
    return this.listenTo('after-connection-failed', listener)
  }

  /** Hear of all four moments; the result takes the listener away. */
  subscribeLifecycle(listener: (event: LifecycleEvent) => void): () => void {
    return this.lifecycle.add(listener)
  }

  /** Called by the connection before it is set up. */
  notifyBeforeConnected(): void {
    guarded(() => this.beforeConnected())
    this.lifecycle.tell('before-connected')
  }

  /** Called by the connection when all channels (or the track) of the connector are there. */
  notifyAfterConnected(): void {
    this.setState({ phase: 'open' })
    guarded(() => this.afterConnected())
    this.lifecycle.tell('after-connected')
  }

  /** Called by the connection when it is over, or this connector's channel closed. */
  notifyAfterDisconnected(why: Omit<StoreState, 'phase'> = {}): void {
    this.setState({ phase: 'closed', ...why })
    guarded(() => this.afterDisconnected())
    this.lifecycle.tell('after-disconnected')
  }

  /** Called by the connection when it was lost and is being made anew. */
  notifyInterrupted(why: Omit<StoreState, 'phase'> = {}): void {
    const wasOpen = this.status.get().phase === 'open'
    this.setState({ phase: 'reconnecting', ...why })
    if (!wasOpen) return
    guarded(() => this.afterDisconnected())
    this.lifecycle.tell('after-disconnected')
  }

  /** Called by the connection: messages are lost. */
  missed(gap: Gap): void {
    this.lastGap.set(gap)
  }

  /** Called by the connection when it could not be set up. */
  notifyAfterConnectionFailed(why: Omit<StoreState, 'phase'>): void {
    this.setState({ phase: 'closed', ...why })
    guarded(() => this.afterConnectionFailed())
    this.lifecycle.tell('after-connection-failed')
  }

  /** Called by the connection: no such connector, or (`waiting`) not known yet. */
  setState(state: StoreState): void {
    const now = this.status.get()
    const isSame = now.phase === state.phase && now.code === state.code && now.nearest === state.nearest
    if (!isSame || now.message !== state.message) this.status.set(state)
  }

  /** Called by the connection: the channels to ask of a robot that announces none; none where it is a picture. */
  bareChannels(): readonly ChannelEntry[] {
    const { connectorId, dataType = BARE_TYPES[this.getStoreType()] } = this.robotConnector
    return dataType === 'media' ? [] : [{ label: connectorId, dataType }]
  }

  /** Called by the connection: these channels (already open) now carry the connector. */
  attach(_ports: readonly DataPort[]): void {}

  /** Called by the connection: the channels are gone. */
  detach(): void {}

  /** Called by the connection: `data` arrived on `port`. */
  receive(_data: ArrayBuffer, _info: MessageInfo, _port: DataPort): void {}

  private listenTo(moment: LifecycleEvent, listener: ConnectionListener): () => void {
    return this.lifecycle.add((event) => (event === moment ? listener(this.status.get()) : undefined))
  }
}
