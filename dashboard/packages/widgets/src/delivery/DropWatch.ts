import type { Delivery, DeliveryRow, StoreCounters } from '@mosaic/client'

/** A mark that comes and goes with every sample would say nothing. */
const WINDOW_SAMPLES = 6
/** Of values that may be skipped by design: from this share on the link is too slow for them. */
const MISSED_SHARE = 0.1

interface Totals {
  received: number
  missed: number
  /** What nobody may lose without being told. */
  dropped: number
}

/** Says whether messages of one connector are being dropped now; asked once a second. */
export class DropWatch {
  private readonly samples: Totals[] = []

  constructor(private readonly delivery: Delivery) {}

  /** `row` is what the robot says; undefined: nothing. */
  sample(counters: StoreCounters, row: DeliveryRow | undefined): boolean {
    const { received, missed, incomplete, refused } = counters
    const now = { received, missed, dropped: incomplete + refused + droppedBy(row) }
    this.samples.push(now)
    if (this.samples.length > WINDOW_SAMPLES) this.samples.shift()
    const before = this.samples[0] ?? now
    // A robot that was started anew counts from zero again.
    if (now.dropped < before.dropped) this.samples.length = 0
    return now.dropped > before.dropped || this.isMissing(before, now)
  }

  private isMissing(before: Totals, now: Totals): boolean {
    const missed = now.missed - before.missed
    if (this.delivery === 'reliable') return missed > 0
    return missed > MISSED_SHARE * (now.received - before.received + missed)
  }
}

function droppedBy(row: DeliveryRow | undefined): number {
  return row === undefined ? 0 : row.dropped + row.tooLarge + row.lost
}
