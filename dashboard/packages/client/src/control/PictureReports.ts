/**
 * Decides what the robot is told of the pictures on this screen, purely: ten times a second per watched picture, the newest at
 * once where that is not too often. A frozen picture is reported as the old one that it is.
 */
import { MEDIA_SEEN_PERIOD_MS, type MediaSeen } from '@mosaic/protocol'

/** Ticks are never exactly on time; one that is this early counts. */
const EARLY_MS = MEDIA_SEEN_PERIOD_MS / 10

interface Watched {
  captureUs: number | null
  reportedAtMs: number
}

export class PictureReports {
  private readonly watched = new Map<string, Watched>()

  get isIdle(): boolean {
    return this.watched.size === 0
  }

  /** The robot was asked for this picture and knows how its clock relates to it. */
  begin(label: string): void {
    if (!this.watched.has(label)) this.watched.set(label, { captureUs: null, reportedAtMs: -Infinity })
  }

  end(label: string): void {
    this.watched.delete(label)
  }

  clear(): void {
    this.watched.clear()
  }

  /** A picture captured then is on the screen: what to tell the robot now, if anything. */
  seen(label: string, captureUs: number, nowMs: number): MediaSeen | null {
    const picture = this.watched.get(label)
    if (!picture) return null
    // Two views of one picture may differ by a frame; an older one changes nothing.
    if (picture.captureUs !== null && captureUs <= picture.captureUs) return null
    picture.captureUs = captureUs
    return isDue(picture, nowMs) ? report(label, picture, nowMs) : null
  }

  /** What to tell the robot now. */
  ticked(nowMs: number): MediaSeen[] {
    const due = [...this.watched].filter(([, picture]) => isDue(picture, nowMs))
    return due.map(([label, picture]) => report(label, picture, nowMs))
  }
}

function isDue({ reportedAtMs }: Watched, nowMs: number): boolean {
  return nowMs - reportedAtMs >= MEDIA_SEEN_PERIOD_MS - EARLY_MS
}

function report(label: string, picture: Watched, nowMs: number): MediaSeen {
  picture.reportedAtMs = nowMs
  return picture.captureUs === null ? { label } : { label, captureUs: picture.captureUs }
}
