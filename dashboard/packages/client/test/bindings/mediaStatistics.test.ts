import { describe, expect, test } from 'vitest'
import { inboundOf, mediaStatistics, type StatisticsSample } from '../../src/bindings/mediaStatistics'
import { receiverSource } from '../../src/bindings/receiverSource'

const sample = (inbound: StatisticsSample['inbound']): StatisticsSample => ({ inbound, codec: 'video/VP8' })

describe('statistics of a picture', () => {
  const before = sample({ timestamp: 1000, bytesReceived: 0, packetsLost: 10, packetsReceived: 100, jitterBufferDelay: 1, jitterBufferEmittedCount: 30 })
  const now = sample({
    timestamp: 2000,
    bytesReceived: 125_000,
    packetsLost: 15,
    packetsReceived: 195,
    freezeCount: 2,
    jitterBufferDelay: 1.9,
    jitterBufferEmittedCount: 60,
  })

  test('lie between two reports', () => {
    const { bitrateBps, lossShare, bufferMs, freezes } = mediaStatistics(now, before)
    expect(bitrateBps).toBe(1_000_000)
    expect(lossShare).toBeCloseTo(0.05)
    expect(bufferMs).toBeCloseTo(30)
    expect(freezes).toBe(2)
  })

  test('are unknown with one report, or where the browser is silent', () => {
    expect(mediaStatistics(now, null)).toMatchObject({ bitrateBps: null, lossShare: null })
    expect(mediaStatistics(sample({}), sample({}))).toMatchObject({ lossShare: null, bufferMs: null, freezes: null, widthPx: null })
  })

  test('a count that went back is no loss', () => {
    expect(mediaStatistics(sample({ packetsLost: 3, packetsReceived: 120 }), before).lossShare).toBe(0)
  })

  test('are those of the stream that comes in, with its codec', () => {
    const report = new Map<string, unknown>([
      ['a', { type: 'transport' }],
      ['b', { type: 'inbound-rtp', codecId: 'c', framesPerSecond: 30 }],
      ['c', { type: 'codec', mimeType: 'video/H264' }],
    ])
    expect(inboundOf(report)).toEqual({ inbound: report.get('b'), codec: 'video/H264' })
    expect(inboundOf(new Map())).toBeNull()
  })
})

test.each([
  [{ jitterBufferTarget: null as number | null }, 80],
  [{}, undefined],
])('the jitter buffer of %j becomes %s', (receiver, expected) => {
  const source = receiverSource(receiver as RTCRtpReceiver, { clock: { now: () => 0 }, link: { pictureAgeMs: () => null }, shown: () => {} })
  source.setBufferTarget(80)
  expect((receiver as { jitterBufferTarget?: number | null }).jitterBufferTarget).toBe(expected)
})
