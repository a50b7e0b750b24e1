/** How loud sound is, as people hear it: logarithmic. Pure. */

/** What a meter shows as nothing. */
export const QUIET_DB = -60

/** Root mean square in dB below full scale; silence is `-Infinity`. */
export function levelDb(samples: ArrayLike<number>): number {
  let squares = 0
  for (let i = 0; i < samples.length; i++) squares += (samples[i] ?? 0) ** 2
  return samples.length === 0 ? -Infinity : 10 * Math.log10(squares / samples.length)
}

/** Length of the meter, 0 to 1. */
export function meterShare(db: number): number {
  return Math.min(1, Math.max(0, 1 - db / QUIET_DB))
}
