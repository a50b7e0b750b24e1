import type { ChannelEntry } from '@mosaic/protocol'
import type { DataPort } from '../delivery/DataPort'
import { nowMs } from '../timing/clock'
import { Value, type Readable } from '../platform/Readable'
import type { RobotConnector } from '../words/types'
import { MosaicStore, type StoreType } from './MosaicStore'
import { OutgoingPort } from './OutgoingPort'

const PERIOD_MS = 500

/**
 * Measures the round trip through a `connection-check` connector: it sends the time on `L-receiver`, the robot echoes it on
 * `L-sender`. It is measured while somebody listens to `roundTripMs`.
 */
export class ConnectionCheckingStore extends MosaicStore {
  private readonly outgoing = new OutgoingPort()
  private readonly measured = new Value<number | null>(null)
  private listeners = 0
  private timer: ReturnType<typeof setInterval> | null = null
  private isAttached = false

  /** Milliseconds there and back; null before the first answer and while disconnected. */
  readonly roundTripMs: Readable<number | null>

  constructor(
    robotConnector: RobotConnector,
    private readonly now: () => number = nowMs,
  ) {
    super(robotConnector)
    this.roundTripMs = {
      get: this.measured.get,
      subscribe: (listener) => this.listen(listener),
    }
  }

  getStoreType(): StoreType {
    return 'bidirectional'
  }

  override bareChannels(): readonly ChannelEntry[] {
    const { connectorId } = this.robotConnector
    return [
      { label: `${connectorId}-receiver`, dataType: 'string-u2r' },
      { label: `${connectorId}-sender`, dataType: 'string-r2u' },
    ]
  }

  override attach(ports: readonly DataPort[]): void {
    this.outgoing.attach(ports)
    this.isAttached = true
    this.runOrRest()
  }

  override detach(): void {
    this.outgoing.detach()
    this.isAttached = false
    this.measured.set(null)
    this.runOrRest()
  }

  override receive(data: ArrayBuffer): void {
    const createdAtMs = createdAt(new TextDecoder().decode(data))
    if (createdAtMs !== null) this.measured.set(this.now() - createdAtMs)
  }

  private listen(listener: () => void): () => void {
    const unsubscribe = this.measured.subscribe(listener)
    this.listeners += 1
    this.runOrRest()
    let isListening = true
    return () => {
      if (!isListening) return
      isListening = false
      unsubscribe()
      this.listeners -= 1
      this.runOrRest()
    }
  }

  private runOrRest(): void {
    const shallRun = this.isAttached && this.listeners > 0
    if (shallRun && this.timer === null) {
      this.ask()
      this.timer = setInterval(() => this.ask(), PERIOD_MS)
    } else if (!shallRun && this.timer !== null) {
      clearInterval(this.timer)
      this.timer = null
    }
  }

  private ask(): void {
    this.outgoing.sendJson({ messageCreated: this.now() })
  }
}

function createdAt(text: string): number | null {
  try {
    const value: unknown = JSON.parse(text)
    if (typeof value !== 'object' || value === null || !('messageCreated' in value)) return null
    return typeof value.messageCreated === 'number' ? value.messageCreated : null
  } catch {
    return null
  }
}
