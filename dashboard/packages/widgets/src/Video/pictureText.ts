/** The line over a picture. */
import type { MediaStatistics } from '@mosaic/client'

export interface PictureFacts {
  framesPerSecond: number | null
  widthPx: number
  heightPx: number
  roundTripMs: number | null
  pictureAgeMs: number | null
  statistics: MediaStatistics | null
}

export function pictureText(facts: PictureFacts): string {
  const { statistics } = facts
  const parts = [
    facts.framesPerSecond === null ? null : `${Math.round(facts.framesPerSecond)} fps`,
    facts.widthPx > 0 ? `${facts.widthPx}×${facts.heightPx}` : null,
    facts.pictureAgeMs === null ? null : `age ${Math.round(facts.pictureAgeMs)} ms`,
    facts.roundTripMs === null ? null : `rtt ${Math.round(facts.roundTripMs)} ms`,
    statistics?.bitrateBps == null ? null : formattedBitrate(statistics.bitrateBps),
    statistics !== null && statistics.packetsLost > 0 ? `${statistics.packetsLost} lost` : null,
  ]
  return parts.filter((part) => part !== null).join(' · ')
}

export function formattedBitrate(bitrateBps: number): string {
  return bitrateBps >= 1e6 ? `${(bitrateBps / 1e6).toFixed(1)} Mbit/s` : `${Math.round(bitrateBps / 1000)} kbit/s`
}
