import type { SendBlock } from '../words/views'
import type { DataPort } from '../delivery/DataPort'
import { Value } from '../platform/Readable'
import type { OutgoingStream } from '../resume/OutgoingStream'

/** One message: an object or array goes as JSON, a string as text, an `ArrayBuffer` or a view of one as bytes. */
export type Sendable = string | ArrayBuffer | ArrayBufferView | object

/** Sends for a store, on the first of its channels that takes data towards the robot, while there is one. */
export class OutgoingPort {
  private port: DataPort | null = null
  private stream: OutgoingStream | null = null

  /** Why nothing may leave; told by the connection. */
  readonly block = new Value<SendBlock | null>(null)

  attach(ports: readonly DataPort[]): void {
    this.port = ports.find((port) => port.isSendable) ?? null
    this.stream = this.port?.stream ?? null
  }

  /** What outlives the channels goes on taking messages. */
  detach(): void {
    this.port = null
  }

  /** Messages are kept and repeated across connections. */
  get outlivesConnection(): boolean {
    return this.stream !== null
  }

  send(data: Sendable): boolean {
    if (typeof data === 'string') return this.put(data)
    const bytes = bytesOf(data)
    return bytes === null ? this.sendJson(data) : this.put(bytes)
  }

  sendJson(value: unknown): boolean {
    const text = strictJson(value)
    return text !== null && this.put(text)
  }

  private put(data: string | Uint8Array): boolean {
    return (this.port ?? this.stream)?.send(data) ?? false
  }
}

function bytesOf(data: object): Uint8Array | null {
  if (data instanceof ArrayBuffer) return new Uint8Array(data)
  return ArrayBuffer.isView(data) ? new Uint8Array(data.buffer, data.byteOffset, data.byteLength) : null
}

// Functions and `undefined` have no text at all, whatever the types say.
function isStrictText(text: unknown, isStrict: boolean): text is string {
  return isStrict && typeof text === 'string'
}

// `JSON.stringify` turns NaN into null, which a robot would take for "no value".
function strictJson(value: unknown): string | null {
  let isStrict = true
  const text: unknown = JSON.stringify(value, (_key, entry: unknown) => {
    if (typeof entry === 'number' && !Number.isFinite(entry)) isStrict = false
    return entry
  })
  return isStrictText(text, isStrict) ? text : null
}
