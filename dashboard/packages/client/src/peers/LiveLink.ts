import type { ControlMessages, MediaOrigin, Stop } from '@mosaic/protocol'
import type { Readable } from '../platform/Readable'
import type { ClockOffset } from '../timing/ClockOffset'
import type { ConnectionPhase, ConnectionState } from '../words/types'
import type { PeerAttempt } from './PeerAttempt'

const COMING: ReadonlySet<ConnectionPhase> = new Set(['connecting', 'connected', 'reconnecting'])

/** Reaches the robot by whichever attempt is live at the moment; without one nothing leaves, and nothing is known. */
export class LiveLink {
  attempt: PeerAttempt | null = null

  constructor(private readonly state: Readable<ConnectionState>) {}

  /** Whether a connection is there or on its way. */
  get isComing(): boolean {
    return COMING.has(this.state.get().phase)
  }

  /** The two clocks of the connection; null without one. */
  get clocks(): ClockOffset | null {
    return this.attempt?.control.clocks ?? null
  }

  /** On the control channel; false where it did not leave. */
  send<T extends keyof ControlMessages>(type: T, data: ControlMessages[T]): boolean {
    return this.attempt?.control.send(type, data) ?? false
  }

  /** On the stop channel; false where it did not leave. */
  sendStop(stop: Stop): boolean {
    return this.attempt?.stop.send(stop) ?? false
  }

  /** A moment of the robot's clock on this page's; null while they have not been compared. */
  toPageMs(robotUs: number): number | null {
    return this.clocks?.toOursMs(robotUs) ?? null
  }

  /** See `ControlChannel.captureUs`. */
  captureUs(rtpTimestamp: number, atMs: number, origin: MediaOrigin): number | null {
    return this.attempt?.control.captureUs(rtpTimestamp, atMs, origin) ?? null
  }

  /** See `MediaStreamStore.pictureAgeMs`. */
  pictureAgeMs(rtpTimestamp: number, atMs: number, origin: MediaOrigin): number | null {
    return this.attempt?.control.pictureAgeMs(rtpTimestamp, atMs, origin) ?? null
  }

  /** The robot's end of the path that is in use; null while unknown. */
  async remoteAddress(): Promise<string | null> {
    return (await this.attempt?.link.remoteAddress()) ?? null
  }
}
