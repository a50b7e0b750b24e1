import type { Refusal } from '@mosaic/protocol'
import type { SendBlock } from '../words/views'
import type { DataPort } from '../delivery/DataPort'
import { Value, type Readable } from '../platform/Readable'
import type { MosaicStore } from './MosaicStore'
import { OutgoingPort, type Sendable } from './OutgoingPort'

/** What a store that sends has beside what every store has. */
export interface Sending {
  /** The last message that the robot did not accept, and why. */
  readonly lastRefusal: Readable<Refusal | null>

  /**
   * What stands in the way of every message, the lease that somebody else holds above all; null: nothing. Without a lease
   * nothing leaves the page; during a stop messages leave and are refused, so that the robot sees who sends on.
   */
  readonly sendBlocked: Readable<SendBlock | null>

  /**
   * Send one message: an object as JSON, a string as text, bytes as they are. False when it was not accepted: blocked,
   * not open, the link does not keep up, or an object that JSON can't hold (NaN, infinities).
   */
  sendData(data: Sendable): boolean

  /** Send any value as JSON, also a number or a text; a value that JSON can't hold is refused. */
  sendJson(value: unknown): boolean

  /** What it sends while the connection is made anew, and what was sent before, still arrives. */
  readonly outlivesConnection: boolean

  /** Called by the connection. */
  setSendBlock(block: SendBlock | null): void

  /** Called by the connection. */
  refused(refusal: Refusal): void
}

// TypeScript asks for exactly these arguments of a class that another one is built upon.
// eslint-disable-next-line @typescript-eslint/no-explicit-any
type StoreClass<S> = abstract new (...args: any[]) => S

/** The store class `Base`, able to send to the robot as well. */
export function sending<Base extends StoreClass<MosaicStore>>(Base: Base): Base & StoreClass<Sending> {
  abstract class SendingStore extends Base implements Sending {
    private readonly outgoing = new OutgoingPort()
    private readonly refusal = new Value<Refusal | null>(null)
    readonly lastRefusal: Readable<Refusal | null> = this.refusal
    readonly sendBlocked: Readable<SendBlock | null> = this.outgoing.block

    get outlivesConnection(): boolean {
      return this.outgoing.outlivesConnection
    }

    sendData(data: Sendable): boolean {
      return this.counted(this.outgoing.send(data))
    }

    sendJson(value: unknown): boolean {
      return this.counted(this.outgoing.sendJson(value))
    }

    override attach(ports: readonly DataPort[]): void {
      this.outgoing.attach(ports)
    }

    override detach(): void {
      this.outgoing.detach()
    }

    setSendBlock(block: SendBlock | null): void {
      if (this.outgoing.block.get()?.code !== block?.code) this.outgoing.block.set(block)
    }

    refused(refusal: Refusal): void {
      this.refusal.set(refusal)
    }

    private counted(isAccepted: boolean): boolean {
      if (!isAccepted && this.outgoing.block.get() === null) this.counters.refused += 1
      return isAccepted
    }
  }
  return SendingStore
}
