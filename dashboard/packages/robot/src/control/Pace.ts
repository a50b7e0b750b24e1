/** Bounds how often somebody may ask: so many at once, and from then on so many a second. */
export class Pace {
  private left: number
  private atMs: number | null = null

  constructor(
    private readonly perSecond: number,
    private readonly atOnce: number,
  ) {
    this.left = atOnce
  }

  /** Whether one more is taken now. */
  admits(nowMs: number): boolean {
    const passedS = this.atMs === null ? 0 : Math.max(0, nowMs - this.atMs) / 1000
    this.atMs = nowMs
    this.left = Math.min(this.atOnce, this.left + passedS * this.perSecond)
    if (this.left < 1) return false
    this.left -= 1
    return true
  }
}
