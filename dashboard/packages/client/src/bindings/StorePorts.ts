import { CHANNEL_PROTOCOL, type MosaicDataType } from '@mosaic/protocol'
import type { ChannelPlan } from './channelPlan'
import type { Clearance } from '../control/clearance'
import { DataPort, type PortMessage } from '../delivery/DataPort'
import type { ChannelPartials } from '../delivery/ChannelPartials'
import type { BulkConnection, ChannelCarrier } from '../peers/BulkConnection'
import type { ConnectionTimeline } from '../peers/ConnectionTimeline'
import type { OutgoingStream } from '../resume/OutgoingStream'
import type { SessionStreams } from '../resume/SessionStreams'
import { ConnectionCheckingStore } from '../stores/ConnectionCheckingStore'
import { arrived, type RobotClock } from '../stores/messageInfo'
import type { MosaicStore } from '../stores/MosaicStore'

/** What the channels of all stores of a robot share. */
export interface PortsSurroundings {
  readonly platform: { now(): number }
  readonly link: { readonly clocks: RobotClock | null }
  /** Told of the first value. */
  readonly record: Pick<ConnectionTimeline, 'mark'>
  /** What outlives the connection. */
  readonly streams: SessionStreams
  readonly bulk: Pick<BulkConnection, 'carrier'>
  readonly partials: ChannelPartials
  /** Whether a message for this store's connector may leave now. */
  readonly clearance: () => Clearance
}

type Channels = ChannelPlan & { type: 'channels' }

/** Opens the data channels that carry one store, and tells the store once all of them are open. */
export class StorePorts {
  private ports: readonly DataPort[] = []
  private carrier: ChannelCarrier | null = null

  constructor(
    private readonly store: MosaicStore,
    private readonly around: PortsSurroundings,
  ) {}

  /** Whether one of them has this label. */
  has(label: string): boolean {
    return this.ports.some((port) => port.label === label)
  }

  isOn(carrier: ChannelCarrier): boolean {
    return this.carrier === carrier
  }

  /** Open them, unless they are there already or shall wait. `isOriginal`: bare payloads. */
  open(link: ChannelCarrier, plan: Channels, isOriginal: boolean): void {
    if (this.ports.length > 0 && this.areThose(plan)) return
    if (this.ports.length > 0) this.close()
    const carrier = plan.delivery === 'bulk' && !isOriginal ? this.around.bulk.carrier(link) : link
    if (carrier === null) return
    this.carrier = carrier
    if (this.store.state.get().phase !== 'reconnecting') this.store.setState({ phase: 'waiting' })
    this.ports = plan.channels.map(({ label, dataType }) => {
      const channel = carrier.openChannel(label, plan.delivery, isOriginal ? '' : CHANNEL_PROTOCOL)
      return this.port(channel, plan, dataType, isOriginal ? null : this.streamFor(plan, label, dataType))
    })
  }

  /** The store stays; its channels are closed. */
  close(): void {
    for (const port of this.ports) port.close()
    this.ports = []
    this.carrier = null
    this.store.detach()
  }

  /** They are closed, and the store is told. */
  lost(): void {
    this.close()
    this.store.notifyAfterDisconnected({ code: 'peer.closed' })
  }

  /** The store is gone: nothing that it sent is kept for another connection. */
  release(): void {
    for (const port of this.ports) this.around.streams.released(port.label)
    this.close()
  }

  private areThose({ channels }: Channels): boolean {
    return this.ports.length === channels.length && channels.every(({ label }) => this.has(label))
  }

  private port(channel: RTCDataChannel, { delivery }: Channels, dataType: MosaicDataType, stream: OutgoingStream | null): DataPort {
    const { platform, partials, clearance } = this.around
    const shared = { now: () => platform.now(), clearance, counters: this.store.counters, partials }
    return new DataPort(channel, { dataType, delivery, ...shared, ...(stream === null ? {} : { stream }) }, {
      opened: () => this.opened(),
      closed: () => this.lost(),
      received: (port, message) => this.received(port, message),
      misread: (port, error) => console.warn(`mosaic: '${port.label}' sent something unreadable (${error.message})`),
    })
  }

  /** What is sent there outlives the connection: never what moves something, which is never kept nor repeated. */
  private streamFor(plan: Channels, label: string, dataType: MosaicDataType): OutgoingStream | null {
    if (plan.mayWait !== true || dataType.endsWith('r2u')) return null
    return this.around.streams.outgoing(label, !(this.store instanceof ConnectionCheckingStore))
  }

  private opened(): void {
    if (!this.ports.every((port) => port.isOpen)) return
    this.store.attach(this.ports)
    this.store.notifyAfterConnected()
  }

  private received(port: DataPort, message: PortMessage): void {
    const deliver = (): void => this.deliver(port, message)
    if (port.isNumbered) this.around.streams.arrived(port.label, message.seq, deliver)
    else deliver()
  }

  private deliver(port: DataPort, { data, seq, stampUs, latched }: PortMessage): void {
    const { platform, record, link } = this.around
    const receivedAtMs = platform.now()
    record.mark('value', receivedAtMs, port.label)
    this.store.receive(data, arrived({ receivedAtMs, seq, stampUs, latched }, link.clocks), port)
  }
}
