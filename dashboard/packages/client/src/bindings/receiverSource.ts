import type { LiveLink } from '../peers/LiveLink'
import { receivedOf } from '../stores/firstFrame'
import { inboundOf, mediaStatistics, type StatisticsSample } from './mediaStatistics'
import type { MediaSource } from '../stores/MediaStreamStore'

export interface SourceSurroundings {
  readonly clock: { now(): number }
  readonly link: Pick<LiveLink, 'pictureAgeMs'>
  /** A picture is on the screen. */
  readonly shown: (rtpTimestamp: number, atMs: number) => void
}

/** What a media store is lent while a track of the live connection carries it. */
export function receiverSource(receiver: RTCRtpReceiver, { clock, link, shown }: SourceSurroundings): MediaSource {
  let previous: StatisticsSample | null = null
  return {
    statistics: async () => {
      const sample = inboundOf(await receiver.getStats())
      if (sample === null) return null
      const statistics = mediaStatistics(sample, previous)
      previous = sample
      return statistics
    },
    received: async () => receivedOf(await receiver.getStats()),
    pictureAgeMs: (rtpTimestamp, atMs, origin) => link.pictureAgeMs(rtpTimestamp, atMs, origin),
    now: () => clock.now(),
    shown,
    setBufferTarget: (targetMs) => {
      // Only Chromium and Safari have it.
      if ('jitterBufferTarget' in receiver) receiver.jitterBufferTarget = targetMs
    },
  }
}
