/** Counts the pictures that were really shown, and says when the last one is too old to act on. */

const WINDOW_MS = 2000
/** A picture older than this is shown as frozen; a slow source gets three of its periods. */
export const STALE_AFTER_MS = 1000

export type PictureState = 'none' | 'live' | 'stale'

export class FrameMeter {
  private times: number[] = []
  private slowestMs = 0

  add(nowMs: number): void {
    const last = this.times.at(-1)
    if (last !== undefined) this.slowestMs = Math.max(nowMs - last, this.slowestMs * 0.9)
    this.times.push(nowMs)
    this.times = this.times.filter((time) => nowMs - time <= WINDOW_MS)
  }

  reset(): void {
    this.times = []
    this.slowestMs = 0
  }

  /** Pictures a second over the last two seconds; null before two were seen. */
  framesPerSecond(nowMs: number): number | null {
    const recent = this.times.filter((time) => nowMs - time <= WINDOW_MS)
    const first = recent[0]
    const last = recent.at(-1)
    if (first === undefined || last === undefined || last === first) return null
    return ((recent.length - 1) * 1000) / (last - first)
  }

  ageMs(nowMs: number): number | null {
    const last = this.times.at(-1)
    return last === undefined ? null : nowMs - last
  }

  state(nowMs: number): PictureState {
    const ageMs = this.ageMs(nowMs)
    if (ageMs === null) return 'none'
    return ageMs > Math.max(STALE_AFTER_MS, Math.min(3 * this.slowestMs, 10_000)) ? 'stale' : 'live'
  }
}
