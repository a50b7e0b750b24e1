/** A timer this late was not held up, the machine was asleep; nor do two clocks differ by so much otherwise. */
export const SLEPT_MS = 3000

/**
 * Notices a sleep that the page's own clock did not count: on many systems only the wall clock goes on meanwhile. One
 * that somebody sets forward looks the same, which costs a question to the robot and the lease.
 */
export class SleepWatch {
  private apartMs: number | null = null

  /** How long the machine has slept since the last look; 0: it was awake, or the page's clock counted it. */
  uncountedMs(nowMs: number, wallMs: number): number {
    const apartMs = wallMs - nowMs
    const gainedMs = apartMs - (this.apartMs ?? apartMs)
    this.apartMs = apartMs
    return gainedMs > SLEPT_MS ? gainedMs : 0
  }
}
