import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest'
import type { Delivered, Resume } from '@mosaic/protocol'
import type { OutgoingStream, StreamPort, WaitingMessage } from '../../src/resume/OutgoingStream'
import { SessionStreams } from '../../src/resume/SessionStreams'

const EXTENSIONS = { resume: 1 }

class FakePort implements StreamPort {
  readonly sent: [string, number | 'plain'][] = []
  isFull = false

  put({ value }: WaitingMessage, seq: number): boolean {
    if (!this.isFull) this.sent.push([String(value), seq])
    return !this.isFull
  }

  putPlain({ value }: WaitingMessage): boolean {
    if (!this.isFull) this.sent.push([String(value), 'plain'])
    return !this.isFull
  }
}

let nowMs: number
let streams: SessionStreams
let told: Delivered[]
let missed: [string, number | null, boolean][]
let port: FakePort

function word(parts: Partial<Resume> = {}): Resume {
  return { bootId: 'robot', isNew: false, received: {}, upcoming: {}, ...parts }
}

function connected(parts: Partial<Resume>, label = 'notes'): OutgoingStream {
  const stream = streams.outgoing(label, true)
  port = new FakePort()
  stream.attach(port)
  streams.greeted(EXTENSIONS)
  streams.resumed(word(parts))
  return stream
}

beforeEach(() => {
  vi.useFakeTimers()
  nowMs = 0
  told = []
  missed = []
  streams = new SessionStreams({ now: () => nowMs }, { send: (_type, delivered) => void told.push(delivered) })
  streams.missed.add((...loss) => missed.push(loss))
})

afterEach(() => void vi.useRealTimers())

describe('what a page sends', () => {
  test('waits for the word of the robot', () => {
    const stream = streams.outgoing('notes', true)
    port = new FakePort()
    stream.attach(port)
    expect(stream.send('a')).toBe(true)
    streams.greeted(EXTENSIONS)
    expect(port.sent).toEqual([])
    streams.resumed(word({ isNew: true, received: { notes: 0 } }))
    expect(stream.send('b')).toBe(true)
    expect(port.sent).toEqual([
      ['a', 1],
      ['b', 2],
    ])
  })

  test('is lost when it waited for more than a minute, though nothing was said after it', () => {
    const stream = connected({ received: { notes: 0 } })
    streams.lost()
    expect(stream.send('old')).toBe(true)
    nowMs = 61_000
    connected({ received: { notes: 0 } })
    expect(port.sent).toEqual([])
  })

  test('is kept without a connection and repeated where the robot lacks it', () => {
    const stream = connected({ received: { notes: 0 } })
    for (const text of ['a', 'b', 'c']) stream.send(text)
    streams.delivered({ seqs: { notes: 1 } })
    streams.lost()
    expect(stream.send('d')).toBe(true)
    expect(streams.word()).toMatchObject({ bootId: 'robot', upcoming: { notes: 2 } })
    connected({ received: { notes: 2 } })
    expect(port.sent).toEqual([
      ['c', 3],
      ['d', 4],
    ])
    expect(missed).toEqual([])
  })

  test('that may have acted is not repeated to a robot which remembers nothing', () => {
    const stream = connected({ received: { notes: 0 } })
    stream.send('a')
    streams.lost()
    stream.send('b')
    connected({ isNew: true, received: { notes: 0 } })
    expect(port.sent).toEqual([['b', 2]])
    expect(missed).toEqual([['notes', 1, true]])
  })

  test('is not kept for a channel on which the robot does not take part', () => {
    const stream = connected({ received: {} }, 'cmd_vel')
    expect(stream.send('go')).toBe(true)
    expect(port.sent).toEqual([['go', 'plain']])
    streams.lost()
    expect(stream.send('go')).toBe(false)
  })

  test('is not overtaken where the robot does not number it and the channel was full', () => {
    const stream = streams.outgoing('notes', true)
    port = new FakePort()
    port.isFull = true
    stream.attach(port)
    stream.send('a')
    streams.greeted({})
    port.isFull = false
    expect(stream.send('b')).toBe(true)
    expect(port.sent).toEqual([
      ['a', 'plain'],
      ['b', 'plain'],
    ])
  })

  test('is bounded while there is no connection', () => {
    const stream = connected({ received: { notes: 0 } })
    streams.lost()
    const accepted = Array.from({ length: 600 }, () => stream.send('x')).filter(Boolean)
    expect(accepted).toHaveLength(512)
  })

  test('goes on as the channel drains', () => {
    const stream = connected({ received: { notes: 0 } })
    streams.lost()
    stream.send('a')
    const next = new FakePort()
    next.isFull = true
    stream.attach(next)
    streams.greeted(EXTENSIONS)
    streams.resumed(word({ received: { notes: 0 } }))
    expect(next.sent).toEqual([])
    next.isFull = false
    stream.pump()
    expect(next.sent).toEqual([['a', 1]])
  })

  test('goes out as before to a robot that knows nothing of it, or does not answer', () => {
    const stream = streams.outgoing('notes', true)
    port = new FakePort()
    stream.attach(port)
    streams.greeted(EXTENSIONS)
    stream.send('a')
    vi.advanceTimersByTime(2000)
    stream.send('b')
    expect(port.sent.map(([text]) => text)).toEqual(['a', 'b'])
  })

  test('ends with the connection when that ends for good', () => {
    const stream = connected({ received: { notes: 0 } })
    stream.send('a')
    streams.close()
    expect(stream.send('b')).toBe(false)
    expect(missed).toEqual([['notes', 1, true]])
    expect(streams.word()).toEqual({ bootId: '', isNew: false, received: {}, upcoming: {} })
  })
})

describe('what a page gets', () => {
  const got: number[] = []
  const arrives = (seq: number): void => streams.arrived('events', seq, () => got.push(seq))
  beforeEach(() => void got.splice(0))

  test('arrives once, and is told after a quarter of a second', () => {
    connected({ isNew: true, upcoming: { events: 1 } })
    for (const seq of [1, 2, 2, 1]) arrives(seq)
    expect(got).toEqual([1, 2])
    vi.advanceTimersByTime(250)
    expect(told).toEqual([{ seqs: { events: 2 } }])
    vi.advanceTimersByTime(1000)
    expect(told).toHaveLength(1)
  })

  test('waits for the word of the robot when it overtakes it', () => {
    streams.greeted(EXTENSIONS)
    arrives(1)
    expect(got).toEqual([])
    streams.resumed(word({ isNew: true, upcoming: { events: 1 } }))
    expect(got).toEqual([1])
  })

  test('goes on after a loss, and a gap is told', () => {
    connected({ isNew: true, upcoming: { events: 1 } })
    arrives(1)
    streams.lost()
    expect(streams.word().received).toEqual({ events: 1 })
    connected({ upcoming: { events: 4 } })
    for (const seq of [4, 5]) arrives(seq)
    expect(got).toEqual([1, 4, 5])
    expect(missed).toEqual([['events', 2, false]])
  })

  test('begins anew with a robot that restarted, and nobody knows how much is lost', () => {
    connected({ isNew: true, upcoming: { events: 1 } })
    arrives(1)
    streams.lost()
    connected({ bootId: 'another', isNew: true, upcoming: { events: 1 } })
    arrives(1)
    expect(got).toEqual([1, 1])
    expect(missed).toEqual([['events', null, false]])
  })

  test('of a fast robot is told before it has to forget', () => {
    connected({ isNew: true, upcoming: { events: 1 } })
    for (let seq = 1; seq <= 128; seq++) arrives(seq)
    expect(told).toEqual([{ seqs: { events: 128 } }])
  })
})
