import { CHANNEL_PROTOCOL, type Refusal } from '@mosaic/protocol'
import { DataPort, type ChannelPartials } from '@mosaic/client/parts'
import type { DataOutlet } from '../connectors/DataOutlet'
import { Pace } from '../control/Pace'

const REFUSALS_PER_S = 10

/** Holds the data channels of one operator, each joined to the outlet of its label. */
export class OutletPorts {
  private readonly ports = new Map<string, DataPort>()
  private readonly joined = new Set<DataPort>()
  private readonly pace = new Pace(REFUSALS_PER_S, REFUSALS_PER_S)

  constructor(
    private readonly outlets: ReadonlyMap<string, DataOutlet>,
    private readonly now: () => number,
    private readonly partials: ChannelPartials,
    private readonly refuse: (refusal: Refusal) => void,
  ) {}

  /** Those that are listened to. */
  get labels(): string[] {
    return [...this.joined].map(({ label }) => label)
  }

  /** A channel of the operator's; one with the label of an open one takes its place. `changed`: it listens, or no longer. */
  opened(channel: RTCDataChannel, changed: () => void): void {
    const outlet = this.outlets.get(channel.label)
    if (outlet === undefined || channel.protocol !== CHANNEL_PROTOCOL) {
      this.say({ label: channel.label.slice(0, 200), code: 'channel.unknown_label' })
      return channel.close()
    }
    const before = this.ports.get(channel.label)
    if (before) this.drop(before, outlet)
    const { dataType, delivery } = outlet.connector.entry
    const join = (): void => this.join(port, outlet, changed)
    const port: DataPort = new DataPort(
      channel,
      { dataType, delivery, now: this.now, partials: this.partials },
      {
        opened: join,
        closed: () => {
          this.leave(port, outlet)
          changed()
        },
        received: (_port, { seq }) => this.say({ label: port.label, seq, code: 'channel.wrong_direction' }),
        misread: (_port, error) => this.say({ label: port.label, code: 'channel.invalid', message: error.message }),
      },
    )
    this.ports.set(channel.label, port)
    // Some browsers hand over a channel that is open already.
    if (port.isOpen) queueMicrotask(join)
  }

  close(): void {
    for (const [label, port] of this.ports) {
      const outlet = this.outlets.get(label)
      if (outlet) this.drop(port, outlet)
    }
  }

  private join(port: DataPort, outlet: DataOutlet, changed: () => void): void {
    if (this.joined.has(port) || this.ports.get(port.label) !== port || !port.isOpen) return
    this.joined.add(port)
    outlet.join(port)
    changed()
  }

  private drop(port: DataPort, outlet: DataOutlet): void {
    this.leave(port, outlet)
    port.close()
  }

  private leave(port: DataPort, outlet: DataOutlet): void {
    if (this.ports.get(port.label) === port) this.ports.delete(port.label)
    if (this.joined.delete(port)) outlet.leave(port)
  }

  private say(refusal: Refusal): void {
    if (this.pace.admits(this.now())) this.refuse(refusal)
  }
}
