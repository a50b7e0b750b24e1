import { Value, type Readable } from '../platform/Readable'
import type { ZerosReport } from '../words/views'

/**
 * Makes connectors of a robot stand that knows no stop, with a message each: the zeros of its drive. What is said of
 * them is what left the page, nothing else.
 */
export class Rests {
  private readonly messages = new Map<string, { text: string }[]>()
  private readonly known = new Value<readonly string[]>([])

  /** The connectors that can be asked to stand. */
  readonly labels: Readable<readonly string[]> = this.known

  constructor(private readonly senders: { sendOn(label: string, text: string): boolean }) {}

  /** The result takes it away again. */
  add(label: string, zero: object): () => void {
    const message = { text: JSON.stringify(zero) }
    this.messages.set(label, [...(this.messages.get(label) ?? []), message])
    this.show()
    return () => {
      const left = (this.messages.get(label) ?? []).filter((one) => one !== message)
      if (left.length > 0) this.messages.set(label, left)
      else this.messages.delete(label)
      this.show()
    }
  }

  /** To all of them, or to those that are `meant`. */
  sendAll(meant: (label: string) => boolean = () => true): ZerosReport {
    const sent: string[] = []
    const unsent: string[] = []
    for (const [label, [message]] of this.messages) {
      if (!meant(label)) continue
      const isSent = message !== undefined && this.senders.sendOn(label, message.text)
      ;(isSent ? sent : unsent).push(label)
    }
    return { sent, unsent }
  }

  private show(): void {
    const labels = [...this.messages.keys()]
    if (labels.join('\n') !== this.known.get().join('\n')) this.known.set(labels)
  }
}
