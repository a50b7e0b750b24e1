/** Serial numbers of 32 bits (RFC 1982). */

export function after(seq: number): number {
  return (seq + 1) >>> 0
}

export function before(seq: number): number {
  return (seq - 1) >>> 0
}

/** How many steps from `older` to `newer`. */
export function distance(older: number, newer: number): number {
  return (newer - older) >>> 0
}

export function isNewer(seq: number, than: number): boolean {
  const steps = distance(than, seq)
  return steps > 0 && steps < 2 ** 31
}
