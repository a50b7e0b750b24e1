/** What was measured about a picture, second by second, for export: bounded, and in forms that other programs read. */
import type { MediaStatistics } from '@mosaic/client'
import type { PictureState } from './frameMeter'
import type { AgeSummary } from './pictureAges'

/** Twenty minutes of seconds. */
export const MAX_RECORDS = 1200

export interface PictureRecord {
  /** Seconds since the page began to watch. */
  t_s: number
  state: PictureState
  age_p50_ms: number | null
  age_p95_ms: number | null
  fps: number | null
  width_px: number | null
  height_px: number | null
  bitrate_bps: number | null
  loss: number | null
  packets_lost: number | null
  freezes: number | null
  frames_dropped: number | null
  jitter_ms: number | null
  buffer_ms: number | null
  round_trip_ms: number | null
  codec: string | null
}

export interface Measured {
  state: PictureState
  ages: AgeSummary | null
  framesPerSecond: number | null
  roundTripMs: number | null
  statistics: MediaStatistics | null
}

export function recordOf(atS: number, { state, ages, framesPerSecond, roundTripMs, statistics }: Measured): PictureRecord {
  return {
    t_s: rounded(atS, 2) ?? 0,
    state,
    age_p50_ms: rounded(ages?.p50Ms),
    age_p95_ms: rounded(ages?.p95Ms),
    fps: rounded(framesPerSecond),
    width_px: statistics?.widthPx ?? null,
    height_px: statistics?.heightPx ?? null,
    bitrate_bps: rounded(statistics?.bitrateBps, 0),
    loss: rounded(statistics?.lossShare, 4),
    packets_lost: statistics?.packetsLost ?? null,
    freezes: statistics?.freezes ?? null,
    frames_dropped: statistics?.framesDropped ?? null,
    jitter_ms: rounded(statistics?.jitterMs),
    buffer_ms: rounded(statistics?.bufferMs),
    round_trip_ms: rounded(roundTripMs),
    codec: statistics?.codec ?? null,
  }
}

const COLUMNS = [
  't_s', 'state', 'age_p50_ms', 'age_p95_ms', 'fps', 'width_px', 'height_px', 'bitrate_bps', 'loss', 'packets_lost', 'freezes',
  'frames_dropped', 'jitter_ms', 'buffer_ms', 'round_trip_ms', 'codec',
] as const satisfies readonly (keyof PictureRecord)[] // prettier-ignore

/** RFC 4180 with a header line; what is not known is an empty cell. */
export function csvOf(records: readonly PictureRecord[]): string {
  const lines = records.map((record) => COLUMNS.map((column) => record[column] ?? '').join(','))
  return [COLUMNS.join(','), ...lines, ''].join('\r\n')
}

export function jsonOf(label: string, records: readonly PictureRecord[]): string {
  return JSON.stringify({ label, records }, null, 2)
}

function rounded(value: number | null | undefined, digits = 1): number | null {
  return value == null || !Number.isFinite(value) ? null : Number(value.toFixed(digits))
}
