import type { ControlMessages, DeliveryRow } from '@mosaic/protocol'
import { Value, type Readable } from '../platform/Readable'

/** How the data of each connector travels, by its label. */
export type DeliveryRows = Readonly<Record<string, DeliveryRow>>

const NONE: DeliveryRows = {}

/** Asks the robot once a second how its data travels, while anybody on this page wants to know. */
export class DeliveryWatch {
  private readonly last = new Value<DeliveryRows>(NONE)
  private watchers = 0
  private isKnown = false

  /** The last report, by label of the connector; empty before the first and toward robots that tell nothing. */
  readonly rows: Readable<DeliveryRows> = this.last

  constructor(private readonly send: (watch: ControlMessages['delivery.watch']) => boolean) {}

  /** Keep asking until the result is called. */
  watch(): () => void {
    this.watchers += 1
    if (this.watchers === 1) this.ask(true)
    let isOver = false
    return () => {
      if (isOver) return
      isOver = true
      this.watchers -= 1
      if (this.watchers === 0) this.ask(false)
    }
  }

  /** The robot's hello, on a new connection. */
  greeted(extensions: Record<string, number>): void {
    this.isKnown = 'delivery' in extensions
    if (this.watchers > 0) this.ask(true)
  }

  /** Called by the connection: the robot's report. */
  heard({ connectors }: ControlMessages['delivery.report']): void {
    this.last.set(Object.fromEntries(connectors.map((row) => [row.label, row])))
  }

  /** The connection is gone: what was told is no longer so. */
  lost(): void {
    this.isKnown = false
    this.last.set(NONE)
  }

  private ask(on: boolean): void {
    if (this.isKnown) this.send({ on })
  }
}
