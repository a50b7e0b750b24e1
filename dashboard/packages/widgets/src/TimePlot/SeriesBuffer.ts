/** Keeps the last minutes of several values, in columns as uPlot wants them. */

export type Column = (number | null)[]

/** Ten minutes at 50 Hz; older values make room. */
const MAX_ROWS = 30_000

/** A pause of so many usual ones, and of so many seconds, is a gap in the lines: nobody knows what was meanwhile. */
const GAP_INTERVALS = 5
const GAP_S = 2
/** Of the usual interval, given to each new one. */
const MEMORY = 0.2

export class SeriesBuffer {
  private times: number[] = []
  private columns: Column[]
  private usualS: number | null = null

  constructor(
    private readonly width: number,
    private readonly keptS: number,
  ) {
    this.columns = Array.from({ length: width }, () => [])
  }

  /** `timeS` never goes back: a value that comes late is put where the last one was. */
  add(timeS: number, values: Column): void {
    const lastS = this.lastS
    if (lastS !== null && this.isGap(timeS - lastS)) this.push(lastS, [])
    this.push(Math.max(timeS, lastS ?? -Infinity), values)
    this.trim()
  }

  private push(timeS: number, values: Column): void {
    this.times.push(timeS)
    for (let index = 0; index < this.width; index++) this.columns[index]?.push(values[index] ?? null)
  }

  /** Learns what is usual from all that is none. */
  private isGap(pauseS: number): boolean {
    const usualS = this.usualS
    if (usualS !== null && pauseS > Math.max(GAP_S, GAP_INTERVALS * usualS)) return true
    this.usualS = usualS === null ? pauseS : usualS + MEMORY * (pauseS - usualS)
    return false
  }

  clear(): void {
    this.times = []
    this.columns = this.columns.map(() => [])
  }

  get length(): number {
    return this.times.length
  }

  get lastS(): number | null {
    return this.times.at(-1) ?? null
  }

  /** The rows of the last `windowS` before `nowS`; times are seconds before now (-windowS to 0). */
  window(nowS: number, windowS: number): [number[], ...Column[]] {
    // One row before the window, so that lines enter from the left edge.
    const from = Math.max(0, firstNotBefore(this.times, nowS - windowS) - 1)
    const until = firstNotBefore(this.times, nowS + 1e-6)
    return [
      this.times.slice(from, until).map((timeS) => timeS - nowS),
      ...this.columns.map((column) => column.slice(from, until)),
    ]
  }

  /** In large pieces, because cutting the head off an array costs its length. */
  private trim(): void {
    const oldestS = (this.lastS ?? 0) - this.keptS
    const stale = firstNotBefore(this.times, oldestS)
    const surplus = Math.max(stale, this.times.length - MAX_ROWS)
    if (surplus < 500 && this.times.length <= MAX_ROWS + 500) return
    this.times.splice(0, surplus)
    for (const column of this.columns) column.splice(0, surplus)
  }
}

/** Index of the first time that is not before `timeS`; the length where there is none. */
export function firstNotBefore(times: readonly number[], timeS: number): number {
  let low = 0
  let high = times.length
  while (low < high) {
    const middle = (low + high) >> 1
    if ((times[middle] ?? Infinity) < timeS) low = middle + 1
    else high = middle
  }
  return low
}
