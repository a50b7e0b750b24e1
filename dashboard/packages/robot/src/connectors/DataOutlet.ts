import { microseconds, type DataPort } from '@mosaic/client/parts'
import type { DataConnector } from './Connector'

interface Told {
  bytes: Uint8Array
  stampUs: number
}

/** Brings what a connector tells to everybody who listens, and measures only while somebody does. */
export class DataOutlet {
  private readonly listeners = new Set<DataPort>()
  private last: Told | null = null
  private end: (() => void) | null = null

  constructor(
    readonly connector: DataConnector,
    private readonly now: () => number,
    private readonly failed: (label: string, problem: string) => void,
  ) {}

  get label(): string {
    return this.connector.entry.label
  }

  get isListenedTo(): boolean {
    return this.listeners.size > 0
  }

  /** Somebody's channel is open: who comes late gets the last value at once. */
  join(port: DataPort): void {
    this.listeners.add(port)
    if (this.last !== null) port.repeat(this.last.bytes, this.last.stampUs)
    this.end ??= this.connector.start({
      tell: (value) => this.tell(value),
      failed: (problem) => this.failed(this.label, problem),
    })
  }

  leave(port: DataPort): void {
    if (!this.listeners.delete(port) || this.listeners.size > 0) return
    this.end?.()
    this.end = null
  }

  private tell(value: object): void {
    const bytes = new TextEncoder().encode(JSON.stringify(value))
    this.last = { bytes, stampUs: microseconds(this.now()) }
    for (const port of this.listeners) port.send(bytes)
  }
}
