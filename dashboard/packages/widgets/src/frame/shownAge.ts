/** What a card says about the age of its value. */
import type { MessageInfo, ShownPicture } from '@mosaic/client'
import { ageOf, exactAge, formattedAge, sinceArrivalMs } from '../stores/age'

/** From here on a value is no longer what the robot says now. */
const OLD_AFTER_MS = 3000

export interface ShownAge {
  text: string
  /** `unknown`: no matter when it arrived, it may be from long ago. `away`: there is none, or no newer one for now. */
  state: 'none' | 'live' | 'old' | 'unknown' | 'away'
}

type Info = Pick<MessageInfo, 'receivedAtMs' | 'ageMs' | 'stampUs' | 'latched'>

/** `isAway`: its connection was lost and is being made anew. `isFailing`: the robot says that the connector fails. */
export function shownAge(info: Info | null, isAway: boolean, nowMs: number, isFailing = false): ShownAge {
  if (info === null) return withoutValue(isAway, isFailing)
  if (isAway) return { text: `reconnecting · ${awayText(info, nowMs)}`, state: 'away' }
  const { text, state } = hereAge(info, nowMs)
  return { text: info.latched ? `latched · ${text}` : text, state }
}

function withoutValue(isAway: boolean, isFailing: boolean): ShownAge {
  if (isAway) return { text: 'reconnecting', state: 'away' }
  return isFailing ? { text: 'failed', state: 'away' } : { text: 'no value yet', state: 'none' }
}

/** Of the picture that stays while the connection is away; empty where there is none. */
export function lastPictureText(picture: ShownPicture | null, nowMs: number): string {
  if (picture === null) return ''
  return `last picture ${awayText({ receivedAtMs: picture.shownAtMs, ageMs: picture.ageMs }, nowMs)}`
}

function awayText(info: Pick<Info, 'receivedAtMs' | 'ageMs'>, nowMs: number): string {
  const ageMs = ageOf(info, nowMs)
  return ageMs === null ? `over ${exactAge(sinceArrivalMs(info, nowMs))} old` : `${exactAge(ageMs)} old`
}

function hereAge(info: Info, nowMs: number): ShownAge {
  const ageMs = ageOf(info, nowMs)
  if (ageMs !== null) return { text: formattedAge(ageMs), state: ageMs > OLD_AFTER_MS ? 'old' : 'live' }
  if (info.stampUs !== 0) return { text: 'age not known', state: 'unknown' }
  // An original robot tells no times: when it arrived is all that anybody knows.
  const heldMs = sinceArrivalMs(info, nowMs)
  const since = heldMs < 1000 ? 'received now' : `received ${formattedAge(heldMs)}`
  return { text: since, state: heldMs > OLD_AFTER_MS ? 'old' : 'unknown' }
}
