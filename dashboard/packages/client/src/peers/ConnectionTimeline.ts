import { MOMENT_TITLES, type Moment, type SignalingMessage } from '@mosaic/protocol'
import type { PeerEvent } from './peerEvents'
import { Value, type Readable } from '../platform/Readable'

/** One moment of a set-up; `atMs` since its beginning. */
export interface TimelineMark {
  moment: Moment
  atMs: number
  detail: string
}

/** One attempt, from the click to the first picture. `code`: why it ended. */
export interface Timeline {
  marks: readonly TimelineMark[]
  code?: string
  endedMs?: number
}

const ORDER = Object.keys(MOMENT_TITLES) as Moment[]
const MAX_DETAIL = 200
const OF_EVENT: Partial<Record<PeerEvent['type'], Moment>> = {
  granted: 'granted',
  offered: 'offered',
  answered: 'answered',
  iceConnected: 'ice',
  linkConnected: 'dtls',
  controlOpened: 'control',
  helloHeard: 'hello',
}

/**
 * Records what happened when, of the newest attempt: each moment once, so it is bounded by itself. Addresses may be in a
 * detail, for the user's own eyes; secrets never are.
 */
export class ConnectionTimeline {
  private readonly current = new Value<Timeline | null>(null)
  private readonly lastFailed = new Value<Timeline | null>(null)
  private beganMs = 0

  /** Null before the first attempt; the last one stays until the next begins. */
  readonly view: Readable<Timeline | null> = this.current
  /** The last attempt that failed, while the next ones are made; null once one came up. */
  readonly failed: Readable<Timeline | null> = this.lastFailed

  begin(nowMs: number): void {
    this.beganMs = nowMs
    this.current.set({ marks: [] })
    this.mark('asked', nowMs)
  }

  heard(event: PeerEvent, nowMs: number): void {
    const moment = OF_EVENT[event.type]
    if (moment !== undefined) this.mark(moment, nowMs)
  }

  /** A message of the server about this attempt. */
  signaled(message: SignalingMessage, nowMs: number): void {
    if (message.type === 'signaling.exchange_ice_candidate') this.mark('candidate', nowMs)
    else if (message.type === 'signaling.send_sdp_answer' && message.data.sdpAnswer.includes('\na=candidate:')) {
      this.mark('candidate', nowMs, 'in the answer')
    }
  }

  /** It happened now; what happens again is not told, nor what comes after the end. */
  mark(moment: Moment, nowMs: number, detail = ''): void {
    const now = this.current.get()
    if (now === null || now.endedMs !== undefined || this.has(moment)) return
    const mark = { moment, atMs: Math.max(0, nowMs - this.beganMs), detail: detail.slice(0, MAX_DETAIL) }
    this.current.set({ ...now, marks: [...now.marks, mark].sort(byTime) })
    if (moment === 'control') this.lastFailed.set(null)
  }

  /** What was found out afterwards about a moment, as the path that ICE chose. */
  explain(moment: Moment, detail: string): void {
    const now = this.current.get()
    if (now === null) return
    const explained = (mark: TimelineMark) => (mark.moment === moment ? { ...mark, detail: detail.slice(0, MAX_DETAIL) } : mark)
    this.current.set({ ...now, marks: now.marks.map(explained) })
  }

  end(code: string, nowMs: number): void {
    const now = this.current.get()
    if (now === null || now.endedMs !== undefined) return
    const ended = { ...now, code, endedMs: Math.max(0, nowMs - this.beganMs) }
    this.current.set(ended)
    this.lastFailed.set(code === 'peer.closed' ? null : ended)
  }

  has(moment: Moment): boolean {
    return this.current.get()?.marks.some((mark) => mark.moment === moment) === true
  }
}

/** For the clipboard: the same keys as Python's. */
export function timelineJson({ marks, code, endedMs }: Timeline): string {
  const told = marks.map(({ moment, atMs, detail }) => ({ moment, title: MOMENT_TITLES[moment], atMs: rounded(atMs), detail }))
  return JSON.stringify({ marks: told, ...(endedMs === undefined ? {} : { code, endedMs: rounded(endedMs) }) }, null, 2)
}

function rounded(ms: number): number {
  return Math.round(ms * 10) / 10
}

function byTime(one: TimelineMark, other: TimelineMark): number {
  return one.atMs - other.atMs || ORDER.indexOf(one.moment) - ORDER.indexOf(other.moment)
}
