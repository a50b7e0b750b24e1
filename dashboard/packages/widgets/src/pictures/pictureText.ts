/** What stands over a picture: a line that never disturbs, or everything that is known. */
import { ageText } from '../stores/age'
import type { AgeSummary } from './pictureAges'
import type { Measured } from './pictureRecords'

export interface PictureFacts extends Measured {
  widthPx: number
  heightPx: number
}

const known = (parts: readonly (string | null)[], separator: string) => parts.filter((part) => part !== null).join(separator)

/** An age is only said of a live picture: of a frozen one it would be the age that it once had. */
function liveAges({ state, ages }: PictureFacts): AgeSummary | null {
  return state === 'live' ? ages : null
}

export function pictureText(facts: PictureFacts): string {
  const ages = liveAges(facts)
  return known(
    [
      ages === null ? null : `${ageText(ages.p50Ms)} old`,
      facts.framesPerSecond === null ? null : `${Math.round(facts.framesPerSecond)} fps`,
      facts.widthPx > 0 ? `${facts.widthPx}×${facts.heightPx}` : null,
      facts.statistics?.bitrateBps == null ? null : formattedBitrate(facts.statistics.bitrateBps),
    ],
    ' · ',
  )
}

/** One line per fact. */
export function detailsText(facts: PictureFacts): string {
  const { statistics } = facts
  const ages = liveAges(facts)
  return known(
    [
      ages === null ? 'Age (glass to glass): not known' : `Age (glass to glass): ${ageText(ages.p50Ms)}, 95 % below ${ageText(ages.p95Ms)}`,
      facts.widthPx > 0 ? `Picture: ${facts.widthPx}×${facts.heightPx}, ${facts.framesPerSecond === null ? '–' : facts.framesPerSecond.toFixed(1)} fps` : null,
      statistics?.bitrateBps == null ? null : `Bit rate: ${formattedBitrate(statistics.bitrateBps)}${codecText(statistics.codec)}`,
      statistics === null ? null : `Loss: ${statistics.lossShare === null ? '–' : `${(statistics.lossShare * 100).toFixed(1)} %`}, ${statistics.packetsLost} packets in all`,
      statistics === null ? null : `Freezes: ${statistics.freezes ?? '–'}, dropped: ${statistics.framesDropped}`,
      statistics?.bufferMs == null ? null : `Buffered: ${Math.round(statistics.bufferMs)} ms, jitter ${statistics.jitterMs === null ? '–' : statistics.jitterMs.toFixed(1)} ms`,
      facts.roundTripMs === null ? null : `Round trip: ${Math.round(facts.roundTripMs)} ms`,
    ],
    '\n',
  )
}

function codecText(codec: string | null): string {
  return codec === null ? '' : `, ${codec.replace(/^video\//i, '')}`
}

export function formattedBitrate(bitrateBps: number): string {
  return bitrateBps >= 1e6 ? `${(bitrateBps / 1e6).toFixed(1)} Mbit/s` : `${Math.round(bitrateBps / 1000)} kbit/s`
}
