/**
 * The frame around every message on a data channel whose DCEP protocol is `mosaic.1`: the twin of
 * `mosaic_core/machines/framing.py`, proved by the golden bytes of `tests/wire/frames.json`.
 */
import {
  CHUNK_HEADER_BYTES,
  CHUNK_PAYLOAD_BYTES,
  CHUNK_TIMEOUT_MS,
  FLAG_CHUNKED,
  FLAG_LATCHED,
  HEADER_BYTES,
  MAX_CHUNKS,
  MAX_MESSAGE_BYTES,
  PayloadKind,
  type ReasonCode,
} from './generated'
import { WireError } from './WireError'

const TWO_32 = 2 ** 32
const KINDS: ReadonlySet<number> = new Set(Object.values(PayloadKind))

/** One whole message. `stampUs` is the sender's monotonic clock, an integer below 2^53. */
export interface Frame {
  kind: PayloadKind
  payload: Uint8Array
  seq: number
  epoch: number
  stampUs: number
  latched: boolean
}

/** The data-channel messages that carry `frame`: one, or its chunks in order. */
export function encodeFrame(frame: Frame, maxPayloadBytes: number = CHUNK_PAYLOAD_BYTES): Uint8Array<ArrayBuffer>[] {
  const size = frame.payload.byteLength
  if (size > MAX_MESSAGE_BYTES) {
    throw new RangeError(`a message may have ${MAX_MESSAGE_BYTES} bytes, this one has ${size}`)
  }
  if (size <= maxPayloadBytes) {
    const whole = new Uint8Array(HEADER_BYTES + size)
    writeHeader(whole, frame, false)
    whole.set(frame.payload, HEADER_BYTES)
    return [whole]
  }
  const count = Math.ceil(size / maxPayloadBytes)
  return Array.from({ length: count }, (_, index) => chunk(frame, index, count, maxPayloadBytes))
}

function chunk(frame: Frame, index: number, count: number, maxPayloadBytes: number): Uint8Array<ArrayBuffer> {
  const part = frame.payload.subarray(index * maxPayloadBytes, (index + 1) * maxPayloadBytes)
  const message = new Uint8Array(HEADER_BYTES + CHUNK_HEADER_BYTES + part.byteLength)
  const view = writeHeader(message, frame, true)
  view.setUint32(HEADER_BYTES, index)
  view.setUint32(HEADER_BYTES + 4, count)
  view.setUint32(HEADER_BYTES + 8, frame.payload.byteLength)
  message.set(part, HEADER_BYTES + CHUNK_HEADER_BYTES)
  return message
}

function writeHeader(message: Uint8Array<ArrayBuffer>, frame: Frame, chunked: boolean): DataView {
  const view = new DataView(message.buffer)
  view.setUint8(0, frame.kind)
  view.setUint8(1, (chunked ? FLAG_CHUNKED : 0) | (frame.latched ? FLAG_LATCHED : 0))
  view.setUint16(2, 0)
  view.setUint32(4, frame.seq >>> 0)
  view.setUint32(8, frame.epoch)
  view.setUint32(12, Math.floor(frame.stampUs / TWO_32))
  view.setUint32(16, frame.stampUs % TWO_32)
  return view
}

interface Partial {
  header: Uint8Array
  totalBytes: number
  touchedAtMs: number
  parts: Map<number, Uint8Array>
  receivedBytes: number
}

/** Turns the messages of one channel back into frames. Bad bytes throw `WireError` and leave the reader usable. */
export class FrameReader {
  private readonly partial = new Map<number, Partial>()

  constructor(
    private readonly maxMessageBytes = MAX_MESSAGE_BYTES,
    private readonly maxPartial = 4,
  ) {}

  /** The frame that `data` completes, or null while chunks are missing. `nowMs`: any monotonic clock. */
  read(data: Uint8Array, nowMs: number): Frame | null {
    if (data.byteLength < HEADER_BYTES) throw new WireError('frame: shorter than its header')
    const view = new DataView(data.buffer, data.byteOffset, data.byteLength)
    const kind = view.getUint8(0)
    if (!isKind(kind)) throw new WireError(`frame: unknown kind ${kind}`)
    const flags = view.getUint8(1)
    const seq = view.getUint32(4)
    const payload = (flags & FLAG_CHUNKED) === 0 ? data.subarray(HEADER_BYTES) : this.collect(data, view, seq, nowMs)
    if (payload === null) return null
    const stampUs = view.getUint32(12) * TWO_32 + view.getUint32(16)
    return { kind, payload, seq, epoch: view.getUint32(8), stampUs, latched: (flags & FLAG_LATCHED) !== 0 }
  }

  private collect(data: Uint8Array, view: DataView, seq: number, nowMs: number): Uint8Array | null {
    if (data.byteLength < HEADER_BYTES + CHUNK_HEADER_BYTES) throw new WireError('frame: shorter than its chunk header')
    const index = view.getUint32(HEADER_BYTES)
    const count = view.getUint32(HEADER_BYTES + 4)
    const total = view.getUint32(HEADER_BYTES + 8)
    const part = data.slice(HEADER_BYTES + CHUNK_HEADER_BYTES)
    if (total === 0 || total > this.maxMessageBytes) throw tooLarge('frame: announced size out of range')
    if (index >= count || count > MAX_CHUNKS || part.byteLength === 0 || count > total) throw new WireError('frame: chunk index out of range')
    this.forgetStale(nowMs)
    const partial = this.partial.get(seq) ?? this.begin(data.slice(0, HEADER_BYTES), seq, total, nowMs)
    if (partial.totalBytes !== total || !isSame(partial.header, data.subarray(0, HEADER_BYTES))) {
      this.partial.delete(seq)
      throw new WireError('frame: chunks of one message disagree')
    }
    if (!partial.parts.has(index)) {
      partial.parts.set(index, part)
      partial.receivedBytes += part.byteLength
    }
    partial.touchedAtMs = nowMs
    if (partial.receivedBytes < total && partial.parts.size < count) return null
    this.partial.delete(seq)
    return joined(partial, count)
  }

  private begin(header: Uint8Array, seq: number, totalBytes: number, nowMs: number): Partial {
    if (this.partial.size >= this.maxPartial) {
      const oldest = [...this.partial].reduce((a, b) => (b[1].touchedAtMs < a[1].touchedAtMs ? b : a))
      this.partial.delete(oldest[0])
    }
    const partial: Partial = { header, totalBytes, touchedAtMs: nowMs, parts: new Map(), receivedBytes: 0 }
    this.partial.set(seq, partial)
    return partial
  }

  private forgetStale(nowMs: number): void {
    for (const [seq, partial] of this.partial) {
      if (nowMs - partial.touchedAtMs > CHUNK_TIMEOUT_MS) this.partial.delete(seq)
    }
  }
}

function joined(partial: Partial, count: number): Uint8Array {
  if (partial.receivedBytes !== partial.totalBytes || partial.parts.size !== count) {
    throw new WireError('frame: chunks do not add up')
  }
  const payload = new Uint8Array(partial.totalBytes)
  let offset = 0
  for (let index = 0; index < count; index += 1) {
    const part = partial.parts.get(index)
    if (part === undefined) throw new WireError('frame: chunks do not add up')
    payload.set(part, offset)
    offset += part.byteLength
  }
  return payload
}

function isKind(kind: number): kind is PayloadKind {
  return KINDS.has(kind)
}

function isSame(a: Uint8Array, b: Uint8Array): boolean {
  return a.every((byte, index) => byte === b[index])
}

function tooLarge(message: string): WireError {
  return new WireError(message, 'channel.too_large' satisfies ReasonCode)
}

/** Serial-number comparison (RFC 1982) of two message numbers. */
export function isNewer(seq: number, than: number): boolean {
  const ahead = (seq - than) >>> 0
  return ahead > 0 && ahead < TWO_32 / 2
}
