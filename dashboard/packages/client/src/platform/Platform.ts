import type { Ticks } from '../timing/Ticks'

/** What the client takes from the browser; tests hand in their own. */
export interface Platform {
  now(): number
  random(): number
  /** A clock that keeps its pace in a hidden tab. */
  ticks: Ticks
  fetch: typeof globalThis.fetch
  openWebSocket(url: string): WebSocket
  openPeerConnection(configuration: RTCConfiguration): RTCPeerConnection
  newMediaStream(track: MediaStreamTrack): MediaStream
  /** Outlives the tab; null where the browser forbids it. */
  localStorage: Storage | null
  /** Belongs to the tab. */
  sessionStorage: Storage | null
  isVisible(): boolean
  onVisibilityChange(listener: () => void): void
  /** The page is left: closed, reloaded or put aside. */
  onPageHide(listener: () => void): void
  /** Hold the page, which is being left and gets no later moment: what it has sent leaves meanwhile. */
  standStill(ms: number): void
  /** A page that was put aside is shown again. */
  onPageShow(listener: () => void): void
  /** The machine has a network again, none any more, or another one. */
  onNetworkChange(listener: () => void): void
}
