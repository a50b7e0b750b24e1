/** This page's clock: monotonic, in milliseconds. A wall clock (`Date`) may jump and lies about ages. */
export function nowMs(): number {
  return performance.timeOrigin + performance.now()
}

/** This machine's wall clock: examined, never trusted. */
export function wallClockMs(): number {
  // eslint-disable-next-line no-restricted-syntax
  return Date.now()
}

/** The same in whole microseconds, as frames and pings carry it. */
export function microseconds(ms: number): number {
  return Math.round(ms * 1000)
}
