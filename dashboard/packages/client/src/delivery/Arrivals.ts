import { isNewer } from '@mosaic/protocol'
import type { StoreCounters } from './StoreCounters'

/**
 * Tells from the numbers of a channel's messages which ones never came, and which came late. The twin of
 * `mosaic_core/machines/delivery/arrivals.py`, proved by `tests/wire/arrivals.json`. Of one channel on one connection: its first
 * message is where counting begins.
 */
export class Arrivals {
  private first: number | null = null
  private newest = 0

  constructor(
    private readonly counters: Pick<StoreCounters, 'missed' | 'late'>,
    private readonly isNewestOnly: boolean,
  ) {}

  /** Count a message that arrived; whether anybody still wants it. */
  take(seq: number): boolean {
    if (this.first === null) {
      this.first = this.newest = seq
      return true
    }
    if (isNewer(seq, this.newest)) {
      this.counters.missed += ((seq - this.newest) >>> 0) - 1
      this.newest = seq
      return true
    }
    this.counters.late += 1
    // A robot that repeats itself is no gain.
    if (isNewer(seq, this.first) && seq !== this.newest) this.counters.missed = Math.max(0, this.counters.missed - 1)
    return !this.isNewestOnly
  }
}
