import type { CatalogueEntry } from '@mosaic/protocol'

/** What a connector hands out. `failed` with an empty text: it is well again. */
export interface DataTeller {
  tell: (value: object) => void
  failed: (problem: string) => void
}

/** What a robot measures. */
export interface DataConnector {
  readonly entry: CatalogueEntry
  /** Begin, as somebody listens now; the result ends it. */
  start(teller: DataTeller): () => void
}

/** What a robot films or hears. */
export interface TrackConnector {
  readonly entry: CatalogueEntry
  /** Open the camera or microphone; rejects with what a person can do about it. */
  open(): Promise<MediaStreamTrack>
}
