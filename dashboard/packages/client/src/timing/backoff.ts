export interface BackoffOptions {
  baseMs: number
  maxMs: number
}

/**
 * How long to wait before attempt number `attempt` (from 0): between half and all of an exponentially growing time,
 * so that the pages of a whole control room don't come back at once. `random` is uniform in [0, 1).
 */
export function backoffDelayMs(attempt: number, random: number, options: BackoffOptions): number {
  const fullMs = Math.min(options.maxMs, options.baseMs * 2 ** Math.min(attempt, 30))
  return fullMs * (0.5 + random / 2)
}
