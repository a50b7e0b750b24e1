/** The bars of a timeline: each moment's begins where the one before ended. */
import { MOMENT_TITLES, type Timeline } from '@mosaic/client'

export interface TimelineBar {
  title: string
  /** `42 ms` since the click. */
  at: string
  detail: string
  startPercent: number
  widthPercent: number
  isEnd: boolean
}

/** A bar this thin is still seen. */
const LEAST_PERCENT = 0.8

export function timelineBars({ marks, code, endedMs }: Timeline): TimelineBar[] {
  const totalMs = Math.max(1, endedMs ?? 0, ...marks.map(({ atMs }) => atMs))
  let beforeMs = 0
  const bar = (title: string, atMs: number, detail: string, isEnd = false): TimelineBar => {
    const widthPercent = Math.max(LEAST_PERCENT, ((atMs - beforeMs) / totalMs) * 100)
    const startPercent = Math.min((beforeMs / totalMs) * 100, 100 - widthPercent)
    beforeMs = atMs
    return { title, at: milliseconds(atMs), detail, startPercent, widthPercent, isEnd }
  }
  const bars = marks.map(({ moment, atMs, detail }) => bar(MOMENT_TITLES[moment], atMs, detail))
  const isFailure = endedMs !== undefined && code !== undefined && code !== 'peer.closed'
  return isFailure ? [...bars, bar('Ended', endedMs, code, true)] : bars
}

export function milliseconds(ms: number): string {
  return ms >= 10_000 ? `${(ms / 1000).toFixed(1)} s` : `${Math.round(ms)} ms`
}
