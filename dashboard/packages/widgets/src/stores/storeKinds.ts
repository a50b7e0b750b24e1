/** What a widget may do with a store, told from what the store can do: no widget asks for its class. */
import type {
  Received as MediaReceived,
  MediaStatistics,
  MessageInfo,
  MosaicStore,
  Readable,
  Refusal,
  SendBlock,
  Shown,
  ShownPicture,
  StoreState,
  Talker,
} from '@mosaic/client'

export interface ReceivedMessage {
  data: ArrayBuffer
  info: MessageInfo
}

export interface Receives {
  subscribe(listener: (data: ArrayBuffer, info?: MessageInfo) => void): () => void
  readonly latest: ReceivedMessage | null
}

export interface Sends {
  sendData(data: string | ArrayBuffer | Uint8Array): boolean
}

export interface ShowsMedia {
  readonly state: Readable<StoreState>
  readonly mediaStream: Readable<MediaStream | null>
  readonly statistics: Readable<MediaStatistics | null>
  readonly displayedAgeMs: Readable<number | null>
  /** What has come of the picture so far; null without a connection. */
  received(): Promise<MediaReceived | null>
  pictureShown(rtpTimestamp: number | null, atMs: number): void
  /** The last one that was on the screen, over the loss of a connection too. */
  readonly latestPicture: ShownPicture | null
  /** Keeps the picture coming, also to a hidden page, until the returned function is called. */
  keep(): () => void
  setBufferTarget(targetMs: number | null): void
  setShown(shown: Shown): void
}

export interface MeasuresRoundTrip {
  readonly roundTripMs: Readable<number | null>
}

export interface Refuses {
  readonly lastRefusal: Readable<Refusal | null>
}

/** Says why nothing may be sent now: somebody else commands, the role, a stop. */
export interface Guarded {
  readonly sendBlocked: Readable<SendBlock | null>
}

export function isGuarded(store: object): store is Guarded {
  return 'sendBlocked' in store
}

export interface Talks {
  readonly talker: Readable<Talker | null>
  readonly lastRefusal: Readable<Refusal | null>
  setTrack(track: MediaStreamTrack | null): Promise<boolean>
}

export function refuses(store: object): store is Refuses {
  return 'lastRefusal' in store
}

export function receives(store: object): store is Receives {
  return 'subscribe' in store
}

export function sends(store: object): store is Sends {
  return 'sendData' in store
}

export function showsMedia(store: object): store is ShowsMedia {
  return 'mediaStream' in store
}

export function talks(store: object): store is Talks {
  return 'setTrack' in store
}

export function measuresRoundTrip(store: object): store is MeasuresRoundTrip {
  return 'roundTripMs' in store
}

export type AnyStore = MosaicStore
