/** How old the last value is, by the robot's clock; what is not known is never told as if it were nothing. */
import type { MessageInfo } from '@mosaic/client'

/** Since the robot made it; null while the clocks have not been compared. */
export function ageOf(info: Pick<MessageInfo, 'receivedAtMs' | 'ageMs'>, nowMs: number): number | null {
  return info.ageMs === null ? null : sinceArrivalMs(info, nowMs) + Math.max(0, info.ageMs)
}

/** It is at least this old. */
export function sinceArrivalMs(info: Pick<MessageInfo, 'receivedAtMs'>, nowMs: number): number {
  return Math.max(0, nowMs - info.receivedAtMs)
}

/** Clocks that were compared over a network may differ by some milliseconds: nothing lasts less than no time. */
function lasting(ms: number): number {
  return Math.max(0, ms)
}

/** Milliseconds for people: below ten with one decimal, from a second on in seconds. */
export function formattedMs(ms: number): string {
  const lastsMs = lasting(ms)
  if (lastsMs < 10) return `${lastsMs.toFixed(1)} ms`
  if (lastsMs < 1000) return `${Math.round(lastsMs)} ms`
  return `${lastsMs < 10_000 ? (lastsMs / 1000).toFixed(1) : Math.round(lastsMs / 1000)} s`
}

/** `40 ms`, `2.5 s`; a dash where it is not known. */
export function ageText(ageMs: number | null | undefined): string {
  if (ageMs === null || ageMs === undefined) return '–'
  return ageMs < 1000 ? `${Math.round(lasting(ageMs))} ms` : exactAge(ageMs)
}

/** To a tenth while seconds count: what an operator wants to know while the connection is away. */
export function exactAge(ageMs: number): string {
  if (ageMs < 10_000) return `${(lasting(ageMs) / 1000).toFixed(1)} s`
  const seconds = Math.floor(ageMs / 1000)
  return seconds < 60 ? `${seconds} s` : `${Math.floor(seconds / 60)} min ${seconds % 60} s`
}

export function formattedAge(ageMs: number): string {
  if (ageMs < 1000) return 'live'
  const seconds = Math.floor(ageMs / 1000)
  if (seconds < 60) return `${seconds} s ago`
  const minutes = Math.floor(seconds / 60)
  return minutes < 60 ? `${minutes} min ago` : `${Math.floor(minutes / 60)} h ago`
}
