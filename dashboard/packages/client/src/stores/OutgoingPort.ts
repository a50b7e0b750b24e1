import type { SendBlock } from '../control/views'
import type { DataPort } from '../DataPort'
import { Value } from '../Readable'
import type { OutgoingStream } from '../resume/OutgoingStream'

export type Sendable = string | ArrayBuffer | Uint8Array

/** The sending half of a store: the first of its channels that takes data towards the robot, while there is one. */
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

  send(data: Sendable): boolean {
    if (this.port !== null) return this.port.send(data)
    return this.stream?.send(data instanceof ArrayBuffer ? new Uint8Array(data) : data) ?? false
  }

  sendJson(value: unknown): boolean {
    const text = strictJson(value)
    return text !== null && this.send(text)
  }
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
