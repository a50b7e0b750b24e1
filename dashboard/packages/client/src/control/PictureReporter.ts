import { MEDIA_SEEN_PERIOD_MS, type MediaOrigin, type MediaSeen } from '@mosaic/protocol'
import type { Platform } from '../platform/Platform'
import { PictureReports } from './PictureReports'

/** The way to the robot, while there is one. */
export interface PictureLink {
  send(type: 'media.seen', seen: MediaSeen): boolean
  /** When a picture was captured, on the robot's clock; null while the clocks have not been compared. */
  captureUs(rtpTimestamp: number, atMs: number, origin: MediaOrigin): number | null
}

/** Tells the robot how old the pictures are by which this page drives; the robot slows down by that. */
export class PictureReporter {
  private readonly reports = new PictureReports()
  private readonly origins = new Map<string, MediaOrigin>()
  private readonly watched = new Set<string>()
  private endTicks: (() => void) | null = null

  constructor(
    private readonly platform: Pick<Platform, 'now' | 'ticks'>,
    private readonly link: PictureLink,
  ) {}

  /** The robot was asked for a picture, or to stop sending it. */
  watching(label: string, on: boolean): void {
    if (on) this.watched.add(label)
    else this.watched.delete(label)
    this.follow(label)
  }

  originKnown(origin: MediaOrigin): void {
    const before = this.origins.get(origin.label)
    this.origins.set(origin.label, origin)
    // Another RTP clock: what was told by the old one would outshine everything that comes.
    if (before && (before.rtpOrigin !== origin.rtpOrigin || before.bootId !== origin.bootId)) this.reports.end(origin.label)
    this.follow(origin.label)
  }

  /** A picture with this RTP timestamp is on the screen at `atMs` of this page's clock. */
  seen(label: string, rtpTimestamp: number, atMs: number): void {
    const origin = this.origins.get(label)
    const captureUs = origin ? this.link.captureUs(rtpTimestamp, atMs, origin) : null
    if (captureUs === null) return
    const seen = this.reports.seen(label, captureUs, this.platform.now())
    if (seen) this.link.send('media.seen', seen)
  }

  /** The link is gone, and with it what the robot knows. */
  clear(): void {
    this.watched.clear()
    this.origins.clear()
    this.reports.clear()
    this.runOrRest()
  }

  private follow(label: string): void {
    if (this.watched.has(label) && this.origins.has(label)) this.reports.begin(label)
    else this.reports.end(label)
    this.runOrRest()
  }

  private runOrRest(): void {
    if (this.reports.isIdle) {
      this.endTicks?.()
      this.endTicks = null
    } else this.endTicks ??= this.platform.ticks.every(MEDIA_SEEN_PERIOD_MS, () => this.tick())
  }

  private tick(): void {
    for (const seen of this.reports.ticked(this.platform.now())) this.link.send('media.seen', seen)
  }
}
