/**
 * Chunks become messages again; what never completes is forgotten in time, within a bound over all channels of a peer.
 * The twin of `mosaic_core/machines/delivery/reassembly.py`, proved by the scenarios of `tests/wire/reassembly.json`.
 */
import {
  CHUNK_TIMEOUT_MS,
  MAX_CHUNKS,
  MAX_MESSAGE_BYTES,
  MAX_PARTIAL,
  PARTIALS_BYTES,
  PART_COST_BYTES,
  type ReasonCode,
} from './generated'
import { WireError } from './WireError'

/** So many given-up or forgotten messages are remembered per channel. */
const REMEMBERED = 16

/** One part of a message; `header` is the same in all of its parts. */
export interface Chunk {
  header: Uint8Array
  index: number
  count: number
  totalBytes: number
  part: Uint8Array
}

interface Partial {
  collector: ChunkCollector
  seq: number
  header: Uint8Array
  totalBytes: number
  touchedAtMs: number
  parts: Map<number, Uint8Array>
  receivedBytes: number
}

/** Keeps the unfinished messages of one peer, on all its channels. `nowMs`: any monotonic clock. */
export class Partials {
  private readonly byAge = new Set<Partial>()
  private size = 0

  constructor(private readonly limitBytes = PARTIALS_BYTES) {}

  /** What all unfinished messages of the peer hold, with what each chunk costs beside its payload. */
  get sizeBytes(): number {
    return this.size
  }

  /** Forget what is overdue, also where nothing else arrives. */
  expire(nowMs: number): void {
    for (const partial of [...this.byAge]) {
      if (nowMs - partial.touchedAtMs > partial.collector.timeoutMs) partial.collector.forget(partial.seq)
    }
  }

  /** It has grown; make room, if need be. */
  touched(partial: Partial, moreBytes: number): void {
    this.byAge.delete(partial)
    this.byAge.add(partial)
    this.size += moreBytes
    for (const stalest of [...this.byAge]) {
      if (this.size <= this.limitBytes || this.byAge.size <= 1) return
      stalest.collector.forget(stalest.seq)
    }
  }

  /** It is complete, or given up: it holds nothing any more. */
  gone(partial: Partial): void {
    this.byAge.delete(partial)
    this.size -= costOf(partial)
  }
}

/** Collects the chunks of one channel's messages. */
export class ChunkCollector {
  private readonly partials = new Map<number, Partial>()
  private givenUp: number[] = []
  private untold: number[] = []

  constructor(
    private readonly shared: Partials,
    private readonly maxMessageBytes = MAX_MESSAGE_BYTES,
    private readonly maxPartial = MAX_PARTIAL,
    readonly timeoutMs = CHUNK_TIMEOUT_MS,
  ) {}

  /** The payload that `chunk` completes, or null. Throws `WireError`; the collector stays usable. */
  add(seq: number, chunk: Chunk, nowMs: number): Uint8Array | null {
    const { index, count, totalBytes, part } = chunk
    if (totalBytes === 0 || totalBytes > this.maxMessageBytes) throw tooLarge('frame: announced size out of range')
    if (index >= count || count > MAX_CHUNKS || part.byteLength === 0 || count > totalBytes) {
      throw new WireError('frame: chunk index out of range')
    }
    this.shared.expire(nowMs)
    if (this.givenUp.includes(seq)) return null
    const partial = this.partials.get(seq) ?? this.begin(seq, chunk, nowMs)
    if (partial.totalBytes !== totalBytes || !isSame(partial.header, chunk.header)) {
      this.drop(seq)
      throw new WireError('frame: chunks of one message disagree')
    }
    this.keep(partial, chunk, nowMs)
    if (partial.receivedBytes < totalBytes && partial.parts.size < count) return null
    this.drop(seq)
    return joined(partial, count)
  }

  /** Numbers of the messages whose parts are kept. */
  get unfinished(): number[] {
    return [...this.partials.keys()]
  }

  /** This one will not complete: tell so, and take no more of it. */
  forget(seq: number): void {
    this.drop(seq)
    this.givenUp = [...this.givenUp, seq].slice(-REMEMBERED)
    this.untold = [...this.untold, seq].slice(-REMEMBERED)
  }

  /** Without a word: it is complete, useless or broken. */
  drop(seq: number): void {
    const partial = this.partials.get(seq)
    if (partial === undefined) return
    this.partials.delete(seq)
    this.shared.gone(partial)
  }

  /** The numbers of those forgotten since the last call; of very many the last ones. */
  takeForgotten(): number[] {
    const told = this.untold
    if (told.length > 0) this.untold = []
    return told
  }

  /** The channel is gone. */
  close(): void {
    for (const seq of this.unfinished) this.drop(seq)
  }

  private begin(seq: number, { header, totalBytes }: Chunk, nowMs: number): Partial {
    if (this.partials.size >= this.maxPartial) {
      const stalest = [...this.partials.values()].reduce((a, b) => (b.touchedAtMs < a.touchedAtMs ? b : a))
      this.forget(stalest.seq)
    }
    const empty = { parts: new Map<number, Uint8Array>(), receivedBytes: 0 }
    const partial: Partial = { collector: this, seq, header, totalBytes, touchedAtMs: nowMs, ...empty }
    this.partials.set(seq, partial)
    this.shared.touched(partial, 0)
    return partial
  }

  private keep(partial: Partial, { index, part }: Chunk, nowMs: number): void {
    partial.touchedAtMs = nowMs
    const before = costOf(partial)
    if (!partial.parts.has(index)) {
      partial.parts.set(index, part)
      partial.receivedBytes += part.byteLength
    }
    this.shared.touched(partial, costOf(partial) - before)
  }
}

function costOf(partial: Partial): number {
  return partial.receivedBytes + partial.parts.size * PART_COST_BYTES
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

function isSame(a: Uint8Array, b: Uint8Array): boolean {
  return a.every((byte, index) => byte === b[index])
}

function tooLarge(message: string): WireError {
  return new WireError(message, 'channel.too_large' satisfies ReasonCode)
}
