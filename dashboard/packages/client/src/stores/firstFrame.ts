/** Why a camera that is watched shows nothing, from what has arrived of it; Python decides by the same table. */
import type { ReasonCode } from '@mosaic/protocol'

/** A camera may warm up for seconds; after this somebody who looks at nothing wants to know why. */
export const FIRST_FRAME_TIMEOUT_MS = 8_000

/** Of one track; `reportedPackets` is what the sender reports to have sent, null without a report. */
export interface Received {
  packets: number
  frames: number
  reportedPackets: number | null
}

/** Null where pictures were decoded after all. */
export function firstFrameCode(received: Received | null): ReasonCode | null {
  if (received === null) return 'media.no_first_frame'
  if (received.frames > 0) return null
  if (received.packets > 0) return 'media.not_decoded'
  // Reports are small and go the same way: who tells of packets that never came has lost them on the way.
  return (received.reportedPackets ?? 0) > 0 ? 'media.no_packets' : 'media.not_sent'
}

/** From a receiver's stats report. */
export function receivedOf(report: ReadonlyMap<string, unknown>): Received {
  const entries = [...report.values()] as { type?: string; packetsReceived?: number; framesDecoded?: number; packetsSent?: number }[]
  const inbound = entries.find(({ type }) => type === 'inbound-rtp')
  const told = entries.find(({ type }) => type === 'remote-outbound-rtp')
  return {
    packets: inbound?.packetsReceived ?? 0,
    frames: inbound?.framesDecoded ?? 0,
    reportedPackets: told?.packetsSent ?? null,
  }
}
