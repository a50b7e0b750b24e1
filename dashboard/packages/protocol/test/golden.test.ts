import { readdirSync, readFileSync } from 'node:fs'
import { describe, expect, test } from 'vitest'
import {
  controlText,
  encodeFrame,
  FrameReader,
  parseControl,
  parseSignaling,
  signalingText,
  WireError,
  type ControlMessage,
  type Frame,
  type PayloadKind,
  type SignalingMessage,
} from '../src/index'

const WIRE = new URL('../../../../tests/wire/', import.meta.url)
const SPECIAL = new Set([
  'arrivals.json',
  'frames.json',
  'malformed.json',
  'original_types.json',
  'reassembly.json',
  'resume.json',
])

interface Case {
  name: string
  wire: unknown
  reads_as?: unknown
}

interface GoldenFrame {
  name: string
  kind: PayloadKind
  payload_hex: string
  seq: number
  epoch: number
  stamp_us: number
  latched: boolean
  max_payload_bytes: number
  messages_hex: string[]
}

function readJson(name: string): unknown {
  return JSON.parse(readFileSync(new URL(name, WIRE), 'utf8'))
}

function goldenCases(): [string, string, Case][] {
  const names = readdirSync(WIRE).filter((name) => name.endsWith('.json') && !SPECIAL.has(name))
  return names.flatMap((name) => {
    const { socket, cases } = readJson(name) as { socket: string; cases: Case[] }
    return cases.map((entry): [string, string, Case] => [`${name}: ${entry.name}`, socket, entry])
  })
}

function emitted(message: SignalingMessage): string {
  if (message.type === 'unknown') throw new Error('not understood')
  if (message.type === 'error') return JSON.stringify({ type: message.requestType, data: message.code })
  // A union of words with their data is not a word with its data to the compiler.
  return (signalingText as (type: string, data: unknown) => string)(message.type, message.data)
}

function emittedControl(message: ControlMessage | null): string {
  if (message === null) throw new Error('not understood')
  return (controlText as (type: string, data: unknown) => string)(message.type, message.data)
}

function reemitted(socket: string, text: string): unknown {
  return JSON.parse(socket === 'signaling' ? emitted(parseSignaling(text)) : emittedControl(parseControl(text)))
}

describe.each(goldenCases())('%s', (_name, socket, { wire, reads_as: readsAs }) => {
  const expected = readsAs ?? wire

  test('is read and emitted again', () => {
    expect(reemitted(socket, JSON.stringify(wire))).toEqual(expected)
  })

  test('what is emitted reads as itself', () => {
    expect(reemitted(socket, JSON.stringify(expected))).toEqual(expected)
  })
})

describe('malformed messages', () => {
  const malformed = readJson('malformed.json') as { signaling: string[]; control: string[] }

  test.each(malformed.signaling)('signaling refuses %s', (text) => {
    expect(() => parseSignaling(text)).toThrow(WireError)
  })

  test.each(malformed.control)('the control channel refuses %s', (text) => {
    expect(() => parseControl(text)).toThrow(WireError)
  })
})

describe('frames', () => {
  const golden = readJson('frames.json') as { frames: GoldenFrame[]; malformed_hex: string[] }

  test.each(golden.frames)('$name is encoded to its bytes', (entry) => {
    const messages = encodeFrame(frameOf(entry), entry.max_payload_bytes)
    expect(messages.map((message) => Buffer.from(message).toString('hex'))).toEqual(entry.messages_hex)
  })

  test.each(golden.frames)('the bytes of $name are read as the frame', (entry) => {
    const reader = new FrameReader()
    const results = entry.messages_hex.map((hex) => reader.read(bytesOf(hex), 0))
    expect(results.slice(0, -1).every((result) => result === null)).toBe(true)
    expect(results.at(-1)).toEqual(frameOf(entry))
  })

  test.each(golden.malformed_hex)('malformed bytes %s are refused', (hex) => {
    expect(() => new FrameReader().read(bytesOf(hex), 0)).toThrow(WireError)
  })
})

function frameOf(entry: GoldenFrame): Frame {
  const { kind, seq, epoch, stamp_us: stampUs, latched } = entry
  return { kind, payload: bytesOf(entry.payload_hex), seq, epoch, stampUs, latched }
}

// A plain Uint8Array: a Buffer is one too, but compares unequal.
function bytesOf(hex: string): Uint8Array {
  return Uint8Array.from(Buffer.from(hex, 'hex'))
}
