import type { MediaStatistics } from '../stores/MediaStreamStore'

/** What `getStats` has of an inbound stream; every field may be missing in one browser or another. */
interface Inbound {
  timestamp?: number
  bytesReceived?: number
  frameWidth?: number
  frameHeight?: number
  framesPerSecond?: number
  framesDropped?: number
  packetsLost?: number
  packetsReceived?: number
  freezeCount?: number
  jitterBufferDelay?: number
  jitterBufferEmittedCount?: number
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

/** What two reports say together: bit rate, loss and buffering lie between them. */
export function mediaStatistics(sample: StatisticsSample, previous: StatisticsSample | null): MediaStatistics {
  const { inbound } = sample
  return {
    widthPx: inbound.frameWidth ?? null,
    heightPx: inbound.frameHeight ?? null,
    framesPerSecond: inbound.framesPerSecond ?? null,
    bitrateBps: bitrateBps(inbound, previous?.inbound),
    framesDropped: inbound.framesDropped ?? 0,
    packetsLost: inbound.packetsLost ?? 0,
    lossShare: lossShare(inbound, previous?.inbound),
    freezes: inbound.freezeCount ?? null,
    bufferMs: bufferMs(inbound, previous?.inbound),
    jitterMs: inbound.jitter === undefined ? null : inbound.jitter * 1000,
    codec: sample.codec,
  }
}

function bitrateBps(now: Inbound, before: Inbound | undefined): number | null {
  if (before?.bytesReceived === undefined || before.timestamp === undefined) return null
  const elapsedS = ((now.timestamp ?? 0) - before.timestamp) / 1000
  return elapsedS > 0 ? (((now.bytesReceived ?? 0) - before.bytesReceived) * 8) / elapsedS : null
}

/** Of the packets that were due between the two reports. */
function lossShare(now: Inbound, before: Inbound | undefined): number | null {
  if (before === undefined) return null
  const lost = Math.max(0, (now.packetsLost ?? 0) - (before.packetsLost ?? 0))
  const due = lost + (now.packetsReceived ?? 0) - (before.packetsReceived ?? 0)
  return due > 0 ? lost / due : null
}

/** How long a picture waited in the browser's jitter buffer, on average between the two reports. */
function bufferMs(now: Inbound, before: Inbound | undefined): number | null {
  const count = (now.jitterBufferEmittedCount ?? 0) - (before?.jitterBufferEmittedCount ?? 0)
  const delayS = (now.jitterBufferDelay ?? 0) - (before?.jitterBufferDelay ?? 0)
  return count > 0 ? (delayS / count) * 1000 : null
}
