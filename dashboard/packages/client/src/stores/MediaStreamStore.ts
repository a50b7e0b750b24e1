import type { MediaOrigin } from '@mosaic/protocol'
import type { Received } from './firstFrame'
import { Value, type Readable } from '../platform/Readable'
import type { RobotConnector } from '../words/types'
import { MosaicStore, type StoreType } from './MosaicStore'

/** What the browser measures about a picture, once a second. */
export interface MediaStatistics {
  widthPx: number | null
  heightPx: number | null
  framesPerSecond: number | null
  bitrateBps: number | null
  framesDropped: number
  packetsLost: number
  /** Over the last second. */
  lossShare: number | null
  /** Since the picture began, as the browser counts them; null where it does not. */
  freezes: number | null
  /** Time in the jitter buffer over the last second. */
  bufferMs: number | null
  jitterMs: number | null
  codec: string | null
}

/** A picture that was put on the screen. */
export interface ShownPicture {
  /** When it was, on this page's clock. */
  readonly shownAtMs: number
  /** How old it was then; null where that is not known. */
  readonly ageMs: number | null
}

/** What a connection lends to a media store while it carries a track of it. */
export interface MediaSource {
  statistics(): Promise<MediaStatistics | null>
  /** What has come of it so far. */
  received(): Promise<Received>
  /** Age of the picture with this RTP timestamp at the moment `atMs` of this page's clock; null while unknown. */
  pictureAgeMs(rtpTimestamp: number, atMs: number, origin: MediaOrigin): number | null
  /** This page's clock. */
  now(): number
  /** The picture with this RTP timestamp is on the screen. */
  shown(rtpTimestamp: number, atMs: number): void
  /** How long pictures wait so that late ones don't show; null: as the browser likes. */
  setBufferTarget(targetMs: number | null): void
}

/** How a picture is shown: width × height on the screen, and whether somebody drives by it. */
export interface Shown {
  readonly sizePx: number
  readonly leads: boolean
}

const STATISTICS_PERIOD_MS = 1000
/** A picture that grows or shrinks by less is shown at the same size. */
const OTHER_SIZE = 1.25

/**
 * Plays a picture (or sound). The robot sends it only while somebody listens to `mediaStream` and the page is visible,
 * or while it is kept.
 * Give `mediaStream.get()` to a `<video>`'s `srcObject`.
 */
export class MediaStreamStore extends MosaicStore {
  private readonly stream = new Value<MediaStream | null>(null)
  private readonly measured = new Value<MediaStatistics | null>(null)
  private readonly watched = new Value<boolean>(false)
  private readonly kept = new Value<boolean>(false)
  private readonly view = new Value<Shown | null>(null)
  private keepers = 0
  private readonly displayedAge = new Value<number | null>(null)
  private lastShown: ShownPicture | null = null
  private source: MediaSource | null = null
  private mediaOrigin: MediaOrigin | null = null
  private measuring: ReturnType<typeof setInterval> | null = null
  private bufferTargetMs: number | null = null

  /** What a `<video>` or `<audio>` plays; null while there is none. Listening to it asks the robot for it. */
  readonly mediaStream: Readable<MediaStream | null>
  /** Measured while somebody listens. */
  readonly statistics: Readable<MediaStatistics | null>
  /** True while somebody listens to `mediaStream`. */
  readonly isWatched: Readable<boolean> = this.watched
  /** True while it shall come whoever looks: see `keep`. */
  readonly isKept: Readable<boolean> = this.kept
  /** What `setShown` was told. */
  readonly shown: Readable<Shown | null> = this.view
  /** Glass to glass: how old the last displayed picture was when it was displayed; null while that is not known. */
  readonly displayedAgeMs: Readable<number | null> = this.displayedAge

  constructor(robotConnector: RobotConnector) {
    super(robotConnector)
    this.mediaStream = { get: this.stream.get, subscribe: (listener) => this.watch(listener) }
    this.statistics = { get: this.measured.get, subscribe: (listener) => this.measure(listener) }
  }

  getStoreType(): StoreType {
    return 'media'
  }

  /** Called by the connection; null when the track is gone. */
  setMediaStream(stream: MediaStream | null, source: MediaSource | null = null): void {
    this.source = stream === null ? null : source
    if (stream === null) {
      this.mediaOrigin = null
      this.measured.set(null)
      this.displayedAge.set(null)
    }
    this.source?.setBufferTarget(this.bufferTargetMs)
    this.stream.set(stream)
  }

  /** What has come of the picture so far; null without a connection. */
  async received(): Promise<Received | null> {
    return (await this.source?.received()) ?? null
  }

  /**
   * How long the browser holds pictures back to even out the network: 0 for the newest picture at any price, more for
   * a smooth one, null as the browser likes. It lasts over reconnects; a browser that can't ignores it.
   */
  setBufferTarget(targetMs: number | null): void {
    this.bufferTargetMs = targetMs
    this.source?.setBufferTarget(targetMs)
  }

  /**
   * How the picture is shown: a narrow link serves the picture that leads first, and the others by their size. To be
   * called whenever that changes; what is not told counts as a picture of 640 × 360.
   */
  setShown(shown: Shown): void {
    const before = this.view.get()
    const isOther = before === null || before.leads !== shown.leads || differs(before.sizePx, shown.sizePx)
    if (isOther) this.view.set(shown)
  }

  /**
   * Keeps the picture coming while nobody listens or the page is hidden, as a recording needs it. The returned function
   * ends that; calling it again changes nothing.
   */
  keep(): () => void {
    let isHeld = true
    this.keepers += 1
    this.kept.set(true)
    return () => {
      if (isHeld) this.keepers -= 1
      isHeld = false
      this.kept.set(this.keepers > 0)
    }
  }

  /** Called by the connection: how the RTP clock of this picture relates to the robot's. */
  setOrigin(origin: MediaOrigin): void {
    this.mediaOrigin = origin
  }

  /**
   * How old the picture is that `requestVideoFrameCallback` shows: from capture on the robot to `atMs` of this page's
   * clock (`expectedDisplayTime + performance.timeOrigin`). Null while the robot's clock is not known well enough.
   */
  pictureAgeMs(rtpTimestamp: number, atMs: number): number | null {
    if (this.source === null || this.mediaOrigin === null) return null
    const ageMs = this.source.pictureAgeMs(rtpTimestamp, atMs, this.mediaOrigin)
    // Clocks that were compared over a network may differ by some milliseconds: nothing is younger than now.
    return ageMs === null ? null : Math.max(0, ageMs)
  }

  /**
   * To be called for every picture that is put on the screen (`requestVideoFrameCallback`), with the arguments of
   * `pictureAgeMs`. The robot is told how old the picture is by which somebody drives, and may slow down by that.
   * Without `rtpTimestamp`, which not every browser tells, the age is not known.
   */
  pictureShown(rtpTimestamp: number | null, atMs: number): void {
    const ageMs = rtpTimestamp === null ? null : this.pictureAgeMs(rtpTimestamp, atMs)
    this.lastShown = { shownAtMs: atMs, ageMs }
    this.displayedAge.set(ageMs)
    if (rtpTimestamp !== null) this.source?.shown(rtpTimestamp, atMs)
  }

  /** The last picture that was on the screen, over the loss of a connection too; null before the first. */
  get latestPicture(): ShownPicture | null {
    return this.lastShown
  }

  /** How old the picture on the screen is by now; it grows while the picture is frozen. */
  pictureAgeNowMs(): number | null {
    const ageMs = this.displayedAge.get()
    if (ageMs === null || this.source === null || this.lastShown === null) return null
    return ageMs + Math.max(0, this.source.now() - this.lastShown.shownAtMs)
  }

  private watch(listener: () => void): () => void {
    const unsubscribe = this.stream.subscribe(listener)
    this.watched.set(true)
    return () => {
      unsubscribe()
      if (this.stream.listenerCount === 0) this.watched.set(false)
    }
  }

  private measure(listener: () => void): () => void {
    const unsubscribe = this.measured.subscribe(listener)
    this.measuring ??= setInterval(() => void this.measureOnce(), STATISTICS_PERIOD_MS)
    return () => {
      unsubscribe()
      if (this.measured.listenerCount > 0 || this.measuring === null) return
      clearInterval(this.measuring)
      this.measuring = null
    }
  }

  private async measureOnce(): Promise<void> {
    const { source } = this
    const statistics = (await source?.statistics()) ?? null
    if (source === this.source) this.measured.set(statistics)
  }
}

function differs(onePx: number, otherPx: number): boolean {
  return Math.max(onePx, otherPx) > OTHER_SIZE * Math.min(onePx, otherPx)
}
