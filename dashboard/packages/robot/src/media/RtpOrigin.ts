/**
 * Estimates how the RTP timestamps of a camera's pictures lie on this page's clock. Browsers tell a picture's timestamp when it
 * has been encoded, not when it was captured: the picture that came the quickest tells the most.
 */

const TICKS_PER_MS = 90
const TWO_32 = 2 ** 32
/** The quickest picture counts for so long: a clock that runs away by a thousandth is followed. */
const WINDOW_MS = 10_000
/** Less is not told: it is the pace of the encoder, and each change makes operators forget what they measured. */
const STEP_TICKS = 10 * TICKS_PER_MS

interface Sighting {
  atMs: number
  /** RTP timestamp minus page's clock, in ticks. */
  origin: number
}

export class RtpOrigin {
  private told: number | null = null
  private best: Sighting[] = []

  /** A picture with this timestamp is encoded now. The origin, modulo 2^32, if it is news. */
  seen(rtpTimestamp: number, atMs: number): number | null {
    const origin = modulo32(rtpTimestamp - Math.round(atMs * TICKS_PER_MS))
    if (this.best.some((before) => Math.abs(ahead(origin, before.origin)) > WINDOW_MS * TICKS_PER_MS)) this.best = []
    this.best = this.best.filter((before) => atMs - before.atMs < WINDOW_MS && ahead(before.origin, origin) > 0)
    this.best.push({ atMs, origin })
    const found = this.best[0]?.origin ?? origin
    if (this.told !== null && Math.abs(ahead(found, this.told)) < STEP_TICKS) return null
    this.told = found
    return found
  }
}

/** By how many ticks `a` is ahead of `b`: behind where negative. */
function ahead(a: number, b: number): number {
  const difference = modulo32(a - b)
  return difference < TWO_32 / 2 ? difference : difference - TWO_32
}

function modulo32(ticks: number): number {
  return ((ticks % TWO_32) + TWO_32) % TWO_32
}
