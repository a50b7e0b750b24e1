/**
 * The frame around every message on a data channel whose DCEP protocol is `mosaic.1`: the twin of
 * `mosaic_core/machines/delivery/framing.py`, proved by the golden bytes of `tests/wire/frames.json`.
 */
import {
  CHUNK_HEADER_BYTES,
  CHUNK_PAYLOAD_BYTES,
  CHUNK_TIMEOUT_MS,
  FLAG_CHUNKED,
  FLAG_LATCHED,
  HEADER_BYTES,
  MAX_MESSAGE_BYTES,
  PayloadKind,
  RELIABLE_CHUNK_TIMEOUT_MS,
} from './generated'
import { ChunkCollector, Partials, type Chunk } from './reassembly'
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

/** The bounds of one reader, and what its channel promises. */
export interface ReaderOptions {
  maxMessageBytes?: number
  maxPartial?: number
  /** Messages may get lost on this channel, and parts of older ones are worthless once a newer one is complete. */
  isLossy?: boolean
  /** Shared by all readers of one peer, so that its bound holds for all of them. */
  partials?: Partials
}

/** Turns the messages of one channel back into frames. Bad bytes throw `WireError` and leave the reader usable. */
export class FrameReader {
  /** What is unfinished, and what was forgotten. */
  readonly chunks: ChunkCollector
  private readonly isLossy: boolean
  private newest: number | null = null

  constructor(options: ReaderOptions = {}) {
    this.isLossy = options.isLossy ?? false
    this.chunks = new ChunkCollector(
      options.partials ?? new Partials(),
      options.maxMessageBytes,
      options.maxPartial,
      this.isLossy ? CHUNK_TIMEOUT_MS : RELIABLE_CHUNK_TIMEOUT_MS,
    )
  }

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
    if (this.isLossy) this.supersede(seq)
    const stampUs = view.getUint32(12) * TWO_32 + view.getUint32(16)
    return { kind, payload, seq, epoch: view.getUint32(8), stampUs, latched: (flags & FLAG_LATCHED) !== 0 }
  }

  private collect(data: Uint8Array, view: DataView, seq: number, nowMs: number): Uint8Array | null {
    if (data.byteLength < HEADER_BYTES + CHUNK_HEADER_BYTES) throw new WireError('frame: shorter than its chunk header')
    if (this.isLossy && this.newest !== null && isNewer(this.newest, seq)) return null
    const chunk: Chunk = {
      header: data.slice(0, HEADER_BYTES),
      index: view.getUint32(HEADER_BYTES),
      count: view.getUint32(HEADER_BYTES + 4),
      totalBytes: view.getUint32(HEADER_BYTES + 8),
      part: data.slice(HEADER_BYTES + CHUNK_HEADER_BYTES),
    }
    return this.chunks.add(seq, chunk, nowMs)
  }

  /** A newer value is complete: parts of older ones are worth nothing. */
  private supersede(seq: number): void {
    if (this.newest !== null && !isNewer(seq, this.newest)) return
    this.newest = seq
    for (const older of this.chunks.unfinished) if (isNewer(seq, older)) this.chunks.drop(older)
  }
}

function isKind(kind: number): kind is PayloadKind {
  return KINDS.has(kind)
}

/** Serial-number comparison (RFC 1982) of two message numbers. */
export function isNewer(seq: number, than: number): boolean {
  const ahead = (seq - than) >>> 0
  return ahead > 0 && ahead < TWO_32 / 2
}
