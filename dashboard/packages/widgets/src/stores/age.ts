/** How old the last value is, by the page's own clock and, where it is known, the robot's. */
import type { MessageInfo } from '@mosaic/client'

export function ageOf(info: Pick<MessageInfo, 'receivedAtMs' | 'ageMs'>, nowMs: number): number {
  return Math.max(0, nowMs - info.receivedAtMs + Math.max(0, info.ageMs ?? 0))
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
