interface Sample {
  roundTripUs: number
  offsetUs: number
  atUs: number
}

/** Samples older than this are forgotten: clocks drift, up to some 50 ppm against each other. */
const WINDOW_US = 30_000_000

/**
 * Measures how far the robot's clock is ahead of ours, from four-stamp pings (RFC 5905 §8). Of the recent samples the one with
 * the shortest round trip counts: queues only ever lengthen it, and half of the excess is the error.
 */
export class ClockOffset {
  private samples: Sample[] = []

  /** `t0`, `t3` are stamps of our clock, `t1`, `t2` of the robot's, all in microseconds. */
  add(t0: number, t1: number, t2: number, t3: number): void {
    const roundTripUs = t3 - t0 - (t2 - t1)
    if (roundTripUs < 0) return
    const offsetUs = (t1 - t0 + (t2 - t3)) / 2
    this.samples = this.samples.filter((sample) => t3 - sample.atUs <= WINDOW_US)
    this.samples.push({ roundTripUs, offsetUs, atUs: t3 })
  }

  /** The last round trip; null before the first answer. */
  get roundTripMs(): number | null {
    const last = this.samples.at(-1)
    return last ? last.roundTripUs / 1000 : null
  }

  /** Robot's clock minus ours; null before the first answer. */
  get offsetUs(): number | null {
    const first = this.samples[0]
    if (!first) return null
    return this.samples.reduce((best, sample) => (sample.roundTripUs < best.roundTripUs ? sample : best), first).offsetUs
  }

  /** A moment of the robot's clock on ours; null before the first answer. */
  toOursMs(robotUs: number): number | null {
    const { offsetUs } = this
    return offsetUs === null ? null : (robotUs - offsetUs) / 1000
  }

  /** How old a robot's stamp is at `atMs` of our clock; null before the first answer, never negative. */
  ageMs(stampUs: number, atMs: number): number | null {
    const stampMs = this.toOursMs(stampUs)
    return stampMs === null ? null : Math.max(0, atMs - stampMs)
  }
}
