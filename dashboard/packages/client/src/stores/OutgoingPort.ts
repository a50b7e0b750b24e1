import type { DataPort } from '../DataPort'

export type Sendable = string | ArrayBuffer | Uint8Array

/** The sending half of a store: the first of its channels that takes data towards the robot, while there is one. */
export class OutgoingPort {
  private port: DataPort | null = null

  attach(ports: readonly DataPort[]): void {
    this.port = ports.find((port) => port.isSendable) ?? null
  }

  detach(): void {
    this.port = null
  }

  send(data: Sendable): boolean {
    return this.port?.send(data) ?? false
  }

  sendJson(value: unknown): boolean {
    const text = strictJson(value)
    return text !== null && this.send(text)
  }
}

// `JSON.stringify` turns NaN into null, which a robot would take for "no value".
function strictJson(value: unknown): string | null {
  let isStrict = true
  const text = JSON.stringify(value, (_key, entry: unknown) => {
    if (typeof entry === 'number' && !Number.isFinite(entry)) isStrict = false
    return entry
  }) as string | undefined
  return isStrict && text !== undefined ? text : null
}
