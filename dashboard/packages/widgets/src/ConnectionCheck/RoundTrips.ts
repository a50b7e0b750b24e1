/** Sums up what the last round trips say together. */

const KEPT = 120

export interface RoundTripSummary {
  leastMs: number
  medianMs: number
  mostMs: number
}

export class RoundTrips {
  private values: number[] = []

  add(roundTripMs: number): void {
    this.values = [...this.values.slice(1 - KEPT), roundTripMs]
  }

  summary(): RoundTripSummary | null {
    const sorted = [...this.values].sort((one, other) => one - other)
    const [leastMs, medianMs, mostMs] = [sorted[0], sorted[Math.floor(sorted.length / 2)], sorted.at(-1)]
    if (leastMs === undefined || medianMs === undefined || mostMs === undefined) return null
    return { leastMs, medianMs, mostMs }
  }
}
