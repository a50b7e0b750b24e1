/** Measures how old the displayed pictures were, glass to glass, over the last second: half of them were younger than the median. */

const WINDOW_MS = 1000

export interface AgeSummary {
  p50Ms: number
  p95Ms: number
}

export class PictureAges {
  private samples: { atMs: number; ageMs: number }[] = []

  add(nowMs: number, ageMs: number): void {
    this.samples.push({ atMs: nowMs, ageMs })
    this.forget(nowMs)
  }

  /** Null while no age was measured in the last second. */
  summary(nowMs: number): AgeSummary | null {
    this.forget(nowMs)
    const ages = this.samples.map(({ ageMs }) => ageMs).sort((one, other) => one - other)
    if (ages.length === 0) return null
    return { p50Ms: quantile(ages, 0.5), p95Ms: quantile(ages, 0.95) }
  }

  private forget(nowMs: number): void {
    this.samples = this.samples.filter(({ atMs }) => nowMs - atMs <= WINDOW_MS)
  }
}

/** Of sorted numbers, at least one: the smallest that this share of them does not exceed. */
export function quantile(sorted: readonly number[], share: number): number {
  return sorted[Math.max(0, Math.ceil(share * sorted.length) - 1)] ?? NaN
}
