/** What of protobuf's wire format original point clouds use: integers, and whatever has a length. */
import { CloudError } from './inflated'

const VARINT = 0
const FIXED64 = 1
const BYTES = 2
const FIXED32 = 5

/** The fields of one message; what is absent has proto3's default. */
export interface Fields {
  number: (field: number) => number
  text: (field: number) => string
  /** Every occurrence with a length, in order. */
  bytes: (field: number) => readonly Uint8Array<ArrayBuffer>[]
}

/** Raises `CloudError` for what is no protobuf. */
export function fieldsOf(message: Uint8Array<ArrayBuffer>): Fields {
  const numbers = new Map<number, number>()
  const parts = new Map<number, Uint8Array<ArrayBuffer>[]>()
  const reader = new Reader(message)
  while (!reader.isAtEnd) {
    const tag = reader.varint()
    const field = Math.floor(tag / 8)
    if (field === 0) throw new CloudError('not a protobuf message')
    if (tag % 8 === VARINT) numbers.set(field, reader.varint())
    else if (tag % 8 === BYTES) parts.set(field, [...(parts.get(field) ?? []), reader.bytes(reader.varint())])
    else if (tag % 8 === FIXED64) reader.bytes(8)
    else if (tag % 8 === FIXED32) reader.bytes(4)
    else throw new CloudError('not a protobuf message')
  }
  const bytes = (field: number) => parts.get(field) ?? []
  return { bytes, number: (field) => numbers.get(field) ?? 0, text: (field) => new TextDecoder().decode(bytes(field)[0]) }
}

class Reader {
  private at = 0

  constructor(private readonly message: Uint8Array<ArrayBuffer>) {}

  get isAtEnd(): boolean {
    return this.at >= this.message.length
  }

  /** Beyond 53 bits the value is not exact; nothing that is read here is so large. */
  varint(): number {
    let value = 0
    for (let scale = 1; scale < 2 ** 64; scale *= 128) {
      const byte = this.message[this.at++]
      if (byte === undefined) break
      value += (byte & 0x7f) * scale
      if (byte < 0x80) return value
    }
    throw new CloudError('not a protobuf message')
  }

  bytes(size: number): Uint8Array<ArrayBuffer> {
    if (this.at + size > this.message.length) throw new CloudError('shorter than it says')
    this.at += size
    return this.message.subarray(this.at - size, this.at)
  }
}
