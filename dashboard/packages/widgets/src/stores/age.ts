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

/** To a tenth while seconds count: what an operator wants to know while the connection is away. */
export function exactAge(ageMs: number): string {
  if (ageMs < 10_000) return `${(ageMs / 1000).toFixed(1)} s`
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
