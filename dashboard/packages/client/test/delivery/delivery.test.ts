import { encodeFrame, FrameReader, PayloadKind } from '@mosaic/protocol'
import fc from 'fast-check'
import { readFileSync } from 'node:fs'
import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest'
import { DeliveryWatch, StoreCounters } from '../../src/index'
import { DataPort, type PortOptions } from '../../src/delivery/DataPort'
import { Arrivals } from '../../src/delivery/Arrivals'
import { ChannelPartials } from '../../src/delivery/ChannelPartials'
import { FakeDataChannel } from '../fakes'

interface GoldenCase {
  name: string
  newest_only: boolean
  seqs: number[]
  wanted: boolean[]
  missed: number
  late: number
}

const file = new URL('../../../../../tests/wire/arrivals.json', import.meta.url)
const { cases } = JSON.parse(readFileSync(file, 'utf8')) as { cases: GoldenCase[] }

describe('arrivals', () => {
  test.each(cases)('$name', ({ newest_only: isNewestOnly, seqs, wanted, missed, late }) => {
    const counters = new StoreCounters()
    const arrivals = new Arrivals(counters, isNewestOnly)
    expect(seqs.map((seq) => arrivals.take(seq))).toEqual(wanted)
    expect([counters.missed, counters.late]).toEqual([missed, late])
  })

  test('in any order nothing that came counts as missed', () => {
    fc.assert(
      fc.property(fc.shuffledSubarray([...Array(40).keys()].slice(1)), (rest) => {
        const counters = new StoreCounters()
        const arrivals = new Arrivals(counters, true)
        for (const seq of [0, ...rest]) arrivals.take(seq)
        expect(counters.missed).toBe(Math.max(0, ...rest) - rest.length)
      }),
    )
  })
})

describe('a channel', () => {
  beforeEach(() => void vi.useFakeTimers())
  afterEach(() => void vi.useRealTimers())

  function port(delivery: PortOptions['delivery'], partials?: ChannelPartials) {
    const channel = new FakeDataChannel('pose', { protocol: 'mosaic.1' }).opens()
    const counters = new StoreCounters()
    const got: number[] = []
    const listener = {
      opened: () => {},
      closed: () => {},
      misread: () => {},
      received: (_: DataPort, { seq }: { seq: number }) => void got.push(seq),
    }
    const options = { dataType: 'json-bi', delivery, now: () => performance.now(), counters } as const
    const it = new DataPort(channel as unknown as RTCDataChannel, { ...options, ...(partials && { partials }) }, listener)
    const arrives = (seq: number, size = 3, first = false): void => {
      const frame = { kind: PayloadKind.BYTES, payload: new Uint8Array(size), seq, epoch: 0, stampUs: 0, latched: false }
      const messages = encodeFrame(frame, 4)
      for (const message of first ? messages.slice(0, 1) : messages) channel.onmessage?.({ data: message.buffer })
    }
    const left = (): unknown[][] => {
      const frames = channel.sent.map((data) => (typeof data === 'string' ? null : new FrameReader().read(data, 0)))
      return frames.map((frame) => [frame?.seq, frame?.stampUs])
    }
    return { channel, counters, got, port: it, arrives, left }
  }

  test('hands on only what is newer under latest, and counts what was missed or late', () => {
    const { arrives, counters, got } = port('latest')
    for (const seq of [1, 4, 3, 5]) arrives(seq)
    expect(got).toEqual([1, 4, 5])
    expect(counters).toMatchObject({ received: 4, receivedBytes: 12, missed: 1, late: 1 })
  })

  test('forgets a message that came in part, though nothing else arrives', () => {
    const partials = new ChannelPartials(() => performance.now())
    const { arrives, counters } = port('latest', partials)
    arrives(1, 9, true)
    expect(partials.shared.sizeBytes).toBeGreaterThan(0)
    vi.advanceTimersByTime(7000)
    expect(partials.shared.sizeBytes).toBe(0)
    expect(counters.incomplete).toBe(1)
    expect(vi.getTimerCount()).toBe(0)
  })

  test('lets go what it has in part when it closes', () => {
    const partials = new ChannelPartials(() => performance.now())
    const { arrives, counters, port: it } = port('reliable', partials)
    arrives(1, 9, true)
    it.close()
    expect(partials.shared.sizeBytes).toBe(0)
    vi.advanceTimersByTime(2000)
    expect([counters.incomplete, vi.getTimerCount()]).toEqual([0, 0])
  })

  test('counts what it sent and what a newer value replaced', () => {
    const { channel, counters, port: it } = port('latest')
    it.send('{}')
    channel.bufferedAmount = 100_000
    for (const text of ['a', 'b', 'c']) it.send(text)
    channel.bufferedAmount = 0
    channel.onbufferedamountlow?.()
    expect(counters).toMatchObject({ sent: 2, sentBytes: 3, replaced: 2 })
    channel.bufferedAmount = 100_000
    it.send('d')
    channel.bufferedAmount = 0
    it.send('e')
    expect(counters).toMatchObject({ sent: 3, replaced: 3 })
  })

  test.each(['latest', 'reliable'] as const)('under %s numbers also what never leaves, so that a stall is no pause', (delivery) => {
    const { channel, port: it, left } = port(delivery)
    it.send('a')
    channel.bufferedAmount = 2_000_000
    for (const text of ['b', 'c', 'd']) it.send(text)
    channel.bufferedAmount = 0
    channel.onbufferedamountlow?.()
    it.send('e')
    expect(left().map(([seq]) => seq)).toEqual(delivery === 'latest' ? [1, 4, 5] : [1, 5])
  })

  test('lets nothing grow younger while it waits', () => {
    const { channel, port: it, left } = port('latest')
    vi.advanceTimersByTime(1000)
    const madeUs = Math.round(performance.now() * 1000)
    channel.bufferedAmount = 100_000
    it.send('a')
    vi.advanceTimersByTime(5000)
    channel.bufferedAmount = 0
    channel.onbufferedamountlow?.()
    expect(left()).toEqual([[1, madeUs]])
  })
})

describe('asking the robot', () => {
  const ROW = { label: 'pose', delivery: 'latest', messages: 5, rateHz: 1, bytesPerS: 2, queueMessages: 0, queueBytes: 0,
    replaced: 0, dropped: 1, tooLarge: 0, thinned: 0, refused: 0, lost: 0, resent: 0 } as const // prettier-ignore

  test('begins with the first who wants to know and ends with the last', () => {
    const said: boolean[] = []
    const watch = new DeliveryWatch(({ on }) => said.push(on) > 0)
    const endEarly = watch.watch()
    expect(said).toEqual([])
    watch.greeted({ delivery: 1 })
    const end = watch.watch()
    endEarly()
    endEarly()
    expect(said).toEqual([true])
    watch.heard({ connectors: [ROW] })
    expect(watch.rows.get().pose?.dropped).toBe(1)
    watch.lost()
    expect(watch.rows.get()).toEqual({})
    watch.greeted({ delivery: 1 })
    end()
    expect(said).toEqual([true, true, false])
  })

  test('leaves a robot alone that would not understand', () => {
    const said: boolean[] = []
    const watch = new DeliveryWatch(({ on }) => said.push(on) > 0)
    watch.greeted({})
    watch.watch()()
    expect(said).toEqual([])
  })
})
