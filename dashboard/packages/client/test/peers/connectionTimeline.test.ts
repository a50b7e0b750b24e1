import { MOMENT_TITLES } from '@mosaic/protocol'
import { describe, expect, test } from 'vitest'
import { chosenPath, pathText } from '../../src/peers/chosenPath'
import { ConnectionTimeline, timelineJson } from '../../src/peers/ConnectionTimeline'
import { firstFrameCode, receivedOf } from '../../src/stores/firstFrame'

describe('the timeline of a set-up', () => {
  test('tells each moment once, by time, with what was found out about it later', () => {
    const it = new ConnectionTimeline()
    expect(it.view.get()).toBeNull()
    it.begin(1000)
    it.heard({ type: 'granted' }, 1010)
    it.heard({ type: 'iceConnected' }, 1050)
    it.heard({ type: 'iceConnected' }, 1090)
    it.heard({ type: 'deadlinePassed' }, 1095)
    it.explain('ice', 'host → host')
    expect(it.view.get()?.marks).toEqual([
      { moment: 'asked', atMs: 0, detail: '' },
      { moment: 'granted', atMs: 10, detail: '' },
      { moment: 'ice', atMs: 50, detail: 'host → host' },
    ])
  })

  test('ends once, and nothing comes after the end; the next attempt begins anew', () => {
    const it = new ConnectionTimeline()
    it.begin(0)
    it.end('ice.timeout', 15_000)
    it.end('peer.closed', 16_000)
    it.mark('frame', 17_000)
    expect(it.view.get()).toMatchObject({ code: 'ice.timeout', endedMs: 15_000, marks: [{ moment: 'asked' }] })
    it.begin(20_000)
    expect(it.view.get()).toEqual({ marks: [{ moment: 'asked', atMs: 0, detail: '' }] })
    expect(it.failed.get()?.code).toBe('ice.timeout')
    it.mark('control', 20_100)
    expect(it.failed.get()).toBeNull()
  })

  test('is copied with the keys that Python uses', () => {
    const it = new ConnectionTimeline()
    it.begin(0)
    it.end('dtls.failed', 12.345)
    const title = MOMENT_TITLES.asked
    expect(JSON.parse(timelineJson(it.view.get() ?? { marks: [] }))).toEqual({
      marks: [{ moment: 'asked', title, atMs: 0, detail: '' }],
      code: 'dtls.failed',
      endedMs: 12.3,
    })
  })
})

describe('the chosen path', () => {
  const local = { candidateType: 'relay', protocol: 'udp', relayProtocol: 'tls', address: '203.0.113.1', port: 50_000 }
  const remote = { candidateType: 'host', protocol: 'udp', address: '', port: 5000 }

  test('is the pair that the transport names', () => {
    const report = new Map<string, unknown>([
      ['T', { type: 'transport', selectedCandidatePairId: 'P' }],
      ['P', { type: 'candidate-pair', localCandidateId: 'L', remoteCandidateId: 'R' }],
      ['L', local],
      ['R', remote],
    ])
    const path = chosenPath(report)
    expect(path).toMatchObject({ local: 'relay', remote: 'host', protocol: 'tls', remoteAddress: 'hidden' })
    expect(path && pathText(path)).toBe('relay → host over TLS, IPv4: 203.0.113.1:50000 → hidden')
  })

  test('in browsers without transports it is the pair that is in use', () => {
    const pair = { type: 'candidate-pair', nominated: true, state: 'succeeded', localCandidateId: 'L', remoteCandidateId: 'R' }
    const report = new Map<string, unknown>([
      ['Q', { ...pair, state: 'failed' }],
      ['P', pair],
      ['L', { candidateType: 'host', protocol: 'udp', address: 'fd00::2', port: 1 }],
      ['R', { candidateType: 'srflx', protocol: 'udp', address: 'fd00::3', port: 2 }],
    ])
    expect(chosenPath(report)).toMatchObject({ family: 'IPv6', localAddress: '[fd00::2]:1' })
    expect(chosenPath(new Map())).toBeNull()
  })
})

describe('why no picture is shown', () => {
  test.each([
    [null, 'media.no_first_frame'],
    [{ packets: 0, frames: 0, reportedPackets: null }, 'media.not_sent'],
    [{ packets: 0, frames: 0, reportedPackets: 0 }, 'media.not_sent'],
    [{ packets: 0, frames: 0, reportedPackets: 250 }, 'media.no_packets'],
    [{ packets: 250, frames: 0, reportedPackets: null }, 'media.not_decoded'],
    [{ packets: 250, frames: 3, reportedPackets: 250 }, null],
  ])('%o → %s', (received, code) => {
    expect(firstFrameCode(received)).toBe(code)
  })

  test('is read from the stats of a receiver', () => {
    const report = new Map<string, unknown>([
      ['I', { type: 'inbound-rtp', packetsReceived: 7 }],
      ['O', { type: 'remote-outbound-rtp', packetsSent: 9 }],
    ])
    expect(receivedOf(report)).toEqual({ packets: 7, frames: 0, reportedPackets: 9 })
    expect(receivedOf(new Map())).toEqual({ packets: 0, frames: 0, reportedPackets: null })
  })
})
