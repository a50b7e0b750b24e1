import type { MediaStatistics } from './stores/MediaStreamStore'

/** What `getStats` has of an inbound stream; every field may be missing in one browser or another. */
interface Inbound {
  timestamp?: number
  bytesReceived?: number
  frameWidth?: number
  frameHeight?: number
  framesPerSecond?: number
  framesDropped?: number
  packetsLost?: number
  jitter?: number
  codecId?: string
}

export interface StatisticsSample {
  inbound: Inbound
  codec: string | null
}

/** The entry of the inbound stream in a stats report; null while nothing arrived. */
export function inboundOf(report: ReadonlyMap<string, unknown>): StatisticsSample | null {
  for (const entry of report.values()) {
    const { type } = entry as { type?: string }
    if (type !== 'inbound-rtp') continue
    const inbound = entry as Inbound
    const codec = inbound.codecId === undefined ? undefined : report.get(inbound.codecId)
    return { inbound, codec: (codec as { mimeType?: string } | undefined)?.mimeType ?? null }
  }
  return null
}

/** What two reports say together: the bit rate lies between them. */
export function mediaStatistics(sample: StatisticsSample, previous: StatisticsSample | null): MediaStatistics {
  const { inbound } = sample
  return {
    widthPx: inbound.frameWidth ?? null,
    heightPx: inbound.frameHeight ?? null,
    framesPerSecond: inbound.framesPerSecond ?? null,
    bitrateBps: bitrateBps(inbound, previous?.inbound),
    framesDropped: inbound.framesDropped ?? 0,
    packetsLost: inbound.packetsLost ?? 0,
    jitterMs: inbound.jitter === undefined ? null : inbound.jitter * 1000,
    codec: sample.codec,
  }
}

function bitrateBps(now: Inbound, before: Inbound | undefined): number | null {
  if (before?.bytesReceived === undefined || before.timestamp === undefined) return null
  const elapsedS = ((now.timestamp ?? 0) - before.timestamp) / 1000
  return elapsedS > 0 ? (((now.bytesReceived ?? 0) - before.bytesReceived) * 8) / elapsedS : null
}
