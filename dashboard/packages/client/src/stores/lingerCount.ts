/**
 * Counts references whose zero takes effect only after a while: React mounts twice in StrictMode and widgets move, and
 * an original robot ignores a label that is still open. Pure: time is an argument.
 */
export class LingerCount<K> {
  private readonly counts = new Map<K, number>()
  private readonly emptySince = new Map<K, number>()

  constructor(private readonly lingerMs: number) {}

  /** One more; true when the key is new. */
  retain(key: K): boolean {
    const count = this.counts.get(key)
    this.counts.set(key, (count ?? 0) + 1)
    this.emptySince.delete(key)
    return count === undefined
  }

  /** False for a key that only lingers. */
  isRetained(key: K): boolean {
    return (this.counts.get(key) ?? 0) > 0
  }

  /** One less; true when that was the last one, and the key now lingers. */
  release(key: K, nowMs: number): boolean {
    const count = this.counts.get(key) ?? 0
    if (count === 0) return false
    this.counts.set(key, count - 1)
    if (count > 1) return false
    this.emptySince.set(key, nowMs)
    return true
  }

  /** The keys whose time is over; they are forgotten. */
  expired(nowMs: number): K[] {
    const keys = [...this.emptySince].filter(([, sinceMs]) => nowMs - sinceMs >= this.lingerMs).map(([key]) => key)
    for (const key of keys) {
      this.emptySince.delete(key)
      this.counts.delete(key)
    }
    return keys
  }

  /** When to ask `expired` next; null while nothing lingers. */
  nextExpiryMs(): number | null {
    return this.emptySince.size === 0 ? null : Math.min(...this.emptySince.values()) + this.lingerMs
  }
}
