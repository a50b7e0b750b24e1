import { before, distance, isNewer } from './serial'

/** What one message is: new unless it came before; `lost` messages between the last one and it. */
export interface Arrival {
  isNew: boolean
  lost: number
}

/**
 * Receives on a channel that outlives its connection: drops what comes twice, counts what never comes. The
 * twin of `mosaic_core/machines/delivery/resume.py`; both replay `tests/wire/resume.json`.
 */
export class ResumeReceiver {
  private lostCount = 0
  private passed: number | null
  private told: number | null

  /** `highest` is what it has; null: it takes whatever comes first. */
  constructor(private highest: number | null = 0) {
    this.passed = this.told = highest
  }

  /** The highest number that has arrived, for the sender. */
  get received(): number | null {
    return this.highest
  }

  get lost(): number {
    return this.lostCount
  }

  /** A message of the current connection. */
  arrived(seq: number): Arrival {
    if (this.passed !== null && !isNewer(seq, this.passed)) return { isNew: false, lost: 0 }
    const lost = this.passed === null ? 0 : distance(this.passed, seq) - 1
    this.highest = this.passed = seq
    this.lostCount += lost
    return { isNew: true, lost }
  }

  /**
   * A new connection is up, on which `upcoming` comes next. How many are lost; null: the sender has forgotten what it
   * sent, so nobody knows.
   */
  announced(upcoming: number | null): number | null {
    if (upcoming === null) return this.highest === null || this.highest === 0 ? 0 : null
    const previous = before(upcoming)
    if (this.passed === null) {
      this.highest = this.passed = this.told = previous
      return 0
    }
    if (!isNewer(previous, this.passed)) return 0
    const lost = distance(this.passed, previous)
    // It has not arrived: the sender has to count it too.
    this.passed = previous
    this.lostCount += lost
    return lost
  }

  /** Somebody new listens, and misses nothing of what was before. */
  renewed(): void {
    this.highest = this.passed = this.told = null
  }

  /** What to tell the sender now: the highest number, once; null if it knows already. */
  untold(): number | null {
    if (this.highest === null || this.highest === this.told) return null
    this.told = this.highest
    return this.highest
  }
}
