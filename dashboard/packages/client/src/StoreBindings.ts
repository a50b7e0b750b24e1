import {
  CHANNEL_PROTOCOL,
  type Catalogue,
  type CatalogueEntry,
  type MediaOrigin,
  type MediaTalking,
  type MediaUnavailable,
  type MosaicDataType,
  type Refusal,
} from '@mosaic/protocol'
import { channelPlan, NOT_MEDIA, type ChannelPlan } from './channelPlan'
import type { Clearance } from './control/clearance'
import { DataPort, type PortMessage } from './DataPort'
import { ChannelPartials } from './delivery/ChannelPartials'
import { mediaLines } from './mediaLines'
import type { OutgoingStream } from './resume/OutgoingStream'
import type { SessionStreams } from './resume/SessionStreams'
import { ConnectionCheckingStore } from './stores/ConnectionCheckingStore'
import type { MediaLine, PeerLink } from './PeerLink'
import { BidirectionalStore } from './stores/BidirectionalStore'
import { MediaStreamStore, type MediaSource } from './stores/MediaStreamStore'
import type { MosaicStore } from './stores/MosaicStore'
import { SendableStore } from './stores/SendableStore'
import { TalkStore, type Talker } from './stores/TalkStore'

/** What the bindings need of the live connection. */
export interface BindingHost {
  now(): number
  ageMs(stampUs: number, atMs: number): number | null
  /** Ask the robot for a picture, or to stop; false while that can't be said. */
  watch(label: string, on: boolean): boolean
  mediaSource(label: string, receiver: RTCRtpReceiver): MediaSource
  /** A message of a connector has arrived. */
  valueArrived(label: string): void
  /** What outlives the connection. */
  streams: SessionStreams
  /** A connector of the catalogue has no media line. */
  lineMissing(): void
  /** Where bulk goes; null: it shall wait, because its own connection is being made. */
  bulkCarrier(main: ChannelCarrier): ChannelCarrier | null
  /** Whether a message for this connector may leave now; null: one that nobody knows. */
  clearanceOf(entry: CatalogueEntry | null): Clearance
}

/** A peer connection, as far as channels of connectors go. */
export type ChannelCarrier = Pick<PeerLink, 'openChannel'>

interface Binding {
  store: MosaicStore
  ports: DataPort[]
  /** What the ports were opened on. */
  carrier: ChannelCarrier | null
  stopWatching: (() => void) | null
  isWatching: boolean
}

interface Track {
  stream: MediaStream
  receiver: RTCRtpReceiver
}

/** The stores of one robot and what carries them: channels and tracks of the peer link, while there is one. */
export class StoreBindings {
  private readonly bindings = new Map<string, Binding>()
  private readonly tracks = new Map<string, Track>()
  private readonly origins = new Map<string, MediaOrigin>()
  private readonly talkers = new Map<string, Talker | null>()
  private readonly partials = new ChannelPartials(() => this.host.now())
  private link: PeerLink | null = null
  private catalogue: Catalogue | null = null
  private isOriginal = false
  private isUp = false
  private isGreeted = false

  constructor(
    private readonly host: BindingHost,
    private isVisible: boolean,
  ) {}

  add(store: MosaicStore): void {
    const label = store.robotConnector.connectorId
    const binding: Binding = { store, ports: [], carrier: null, stopWatching: null, isWatching: false }
    this.bindings.set(label, binding)
    if (store instanceof MediaStreamStore) binding.stopWatching = store.isWatched.subscribe(() => this.watch(binding))
    if (this.link) store.notifyBeforeConnected()
    this.bind(binding)
    this.showBlock(binding)
  }

  remove(store: MosaicStore): void {
    const label = store.robotConnector.connectorId
    const binding = this.bindings.get(label)
    if (binding?.store !== store) return
    this.bindings.delete(label)
    binding.stopWatching?.()
    if (binding.isWatching) this.host.watch(label, false)
    for (const port of binding.ports) this.host.streams.released(port.label)
    this.unbind(binding)
  }

  /** The robot's connectors changed, or became known. */
  setCatalogue(catalogue: Catalogue | null): void {
    this.catalogue = catalogue
    for (const binding of this.bindings.values()) this.bind(binding)
    this.showBlocks()
  }

  /** Who may send what may have changed. */
  showBlocks(): void {
    for (const binding of this.bindings.values()) this.showBlock(binding)
  }

  setVisible(isVisible: boolean): void {
    this.isVisible = isVisible
    for (const binding of this.bindings.values()) this.watch(binding)
  }

  /** The media lines to offer: one per media connector in the catalogue's order. */
  mediaLines(): MediaLine[] {
    const wanted = [...this.bindings.values()].filter(({ store }) => store instanceof MediaStreamStore)
    return mediaLines(this.catalogue, wanted.length)
  }

  /** The lines that a further offer must add; none while nobody wants one of them. */
  missingLines(): MediaLine[] {
    const { link, catalogue } = this
    if (link === null || catalogue === null || !this.isUp || !this.isGreeted || this.isOriginal) return []
    const isMissing = (label: string | null): boolean => label !== null && !link.hasLine(label) && !this.tracks.has(label)
    const missing = this.mediaLines().filter(({ label }) => isMissing(label))
    const isWanted = ({ label }: MediaLine): boolean => label !== null && isMediaStore(this.bindings.get(label)?.store)
    return missing.some(isWanted) ? missing : []
  }

  /** A further offer was answered. */
  linesAdded(): void {
    for (const binding of this.bindings.values()) this.bind(binding)
  }

  /** A new attempt begins. */
  begin(): void {
    for (const { store } of this.bindings.values()) store.notifyBeforeConnected()
  }

  /** There is a link: open the channels that are known to be needed. */
  setLink(link: PeerLink): void {
    this.link = link
    this.isOriginal = false
    for (const binding of this.bindings.values()) this.bind(binding)
  }

  /** The link is up: pictures can arrive. */
  linkUp(): void {
    this.isUp = true
    for (const binding of this.bindings.values()) this.bind(binding)
  }

  /** The robot said hello: pictures can be asked for. */
  greeted(): void {
    this.isGreeted = true
    for (const binding of this.bindings.values()) this.watch(binding)
    this.host.lineMissing()
  }

  /** The robot is an original one: channels carry bare payloads, and every picture is sent anyway. */
  treatAsOriginal(): void {
    this.isOriginal = true
    for (const binding of this.bindings.values()) {
      this.closePorts(binding)
      this.bind(binding)
    }
  }

  /** Bulk goes elsewhere from now on; what was carried by `lost` opens anew. */
  laneChanged(lost: ChannelCarrier | null): void {
    for (const binding of this.bindings.values()) {
      if (lost !== null && binding.carrier === lost) {
        this.closePorts(binding)
        binding.store.notifyAfterDisconnected({ code: 'peer.closed' })
      }
      this.bind(binding)
    }
  }

  /** The link is gone; the stores stay. */
  dropLink(): void {
    if (this.link === null) return
    this.link = null
    this.isUp = this.isGreeted = false
    this.tracks.clear()
    this.origins.clear()
    this.talkers.clear()
    for (const binding of this.bindings.values()) this.unbind(binding)
  }

  tellDisconnected(why: { code?: string; message?: string }): void {
    for (const { store } of this.bindings.values()) {
      if (store.state.get().phase !== 'mismatch') store.notifyAfterDisconnected(why)
    }
  }

  /** It was lost and is being made anew. */
  tellInterrupted(why: { code?: string; message?: string }): void {
    for (const { store } of this.bindings.values()) {
      if (store.state.get().phase !== 'mismatch') store.notifyInterrupted(why)
    }
  }

  /** Messages of this channel are lost. */
  missed(label: string, lost: number | null, sent: boolean): void {
    for (const { store, ports } of this.bindings.values()) {
      const isMeant = store.robotConnector.connectorId === label || ports.some((port) => port.label === label)
      if (isMeant) store.missed({ lost, sent, atMs: this.host.now() })
    }
  }

  tellFailed(why: { code: string; message?: string }): void {
    for (const { store } of this.bindings.values()) {
      if (store.state.get().phase !== 'mismatch') store.notifyAfterConnectionFailed(why)
    }
  }

  trackArrived(label: string, stream: MediaStream, receiver: RTCRtpReceiver): void {
    this.tracks.set(label, { stream, receiver })
    const binding = this.bindings.get(label)
    if (!binding) return
    // A wish that came before the line was refused.
    binding.isWatching = false
    this.bind(binding)
  }

  originKnown(origin: MediaOrigin): void {
    this.origins.set(origin.label, origin)
    const store = this.bindings.get(origin.label)?.store
    if (store instanceof MediaStreamStore) store.setOrigin(origin)
  }

  mediaUnavailable({ label, code, message }: MediaUnavailable): void {
    const store = this.bindings.get(label)?.store
    if (store) store.setState(message === undefined ? { phase: 'closed', code } : { phase: 'closed', code, message })
  }

  /** Who is heard on a loudspeaker now. */
  talkingChanged({ label, peerId, name }: MediaTalking): void {
    const talker = peerId === undefined ? null : { peerId, name }
    this.talkers.set(label, talker)
    const store = this.bindings.get(label)?.store
    if (store instanceof TalkStore) store.talkingChanged(talker)
  }

  refused(refusal: Refusal): void {
    for (const { store, ports } of this.bindings.values()) {
      if (store instanceof TalkStore && store.robotConnector.connectorId === refusal.label) store.refused(refusal)
      const isMeant = ports.some((port) => port.label === refusal.label)
      if (isMeant && isSending(store)) store.refused(refusal)
    }
  }

  private bind(binding: Binding): void {
    const plan = channelPlan(binding.store.robotConnector, this.catalogue, this.isOriginal)
    if (plan.type === 'mismatch') binding.store.setState(plan.state)
    else if (plan.type === 'media' && !isMediaStore(binding.store)) binding.store.setState(NOT_MEDIA)
    else if (binding.store.state.get().phase === 'mismatch') binding.store.setState({ phase: 'waiting' })
    if (plan.type === 'media') this.bindMedia(binding.store, binding)
    else if (plan.type === 'channels' && binding.ports.length === 0) this.openPorts(binding, plan)
  }

  private bindMedia(store: MosaicStore, binding: Binding): void {
    if (store instanceof TalkStore) this.bindVoice(store)
    else this.bindTrack(binding)
  }

  private bindVoice(store: TalkStore): void {
    const label = store.robotConnector.connectorId
    if (!this.isUp || this.link === null) return
    const line = this.link.voiceOf(label)
    if (line === null) {
      store.setState({ phase: 'closed', code: 'media.no_line' })
      return this.host.lineMissing()
    }
    if (!store.connectLine(line)) return
    store.talkingChanged(this.talkers.get(label) ?? null)
    store.notifyAfterConnected()
  }

  private openPorts(binding: Binding, plan: ChannelPlan & { type: 'channels' }): void {
    const { link } = this
    if (link === null) return
    const carrier = plan.delivery === 'bulk' && !this.isOriginal ? this.host.bulkCarrier(link) : link
    if (carrier === null) return
    binding.carrier = carrier
    const protocol = this.isOriginal ? '' : CHANNEL_PROTOCOL
    if (binding.store.state.get().phase !== 'reconnecting') binding.store.setState({ phase: 'waiting' })
    binding.ports = plan.channels.map(({ label, dataType }) => {
      const channel = carrier.openChannel(label, plan.delivery, protocol)
      const options = {
        dataType,
        delivery: plan.delivery,
        now: () => this.host.now(),
        clearance: () => this.clearanceOf(binding),
        counters: binding.store.counters,
        partials: this.partials,
        ...this.streamOf(binding, plan, label, dataType),
      }
      return new DataPort(channel, options, {
        opened: () => this.portOpened(binding),
        closed: () => this.portClosed(binding),
        received: (port, message) => this.received(binding, port, message),
        misread: (port, error) => console.warn(`mosaic: '${port.label}' sent something unreadable (${error.message})`),
      })
    })
  }

  /** What is sent there outlives the connection: never what moves something, which is never kept nor repeated. */
  private streamOf({ store }: Binding, plan: ChannelPlan & { type: 'channels' }, label: string, dataType: MosaicDataType): { stream?: OutgoingStream } {
    if (this.isOriginal || plan.mayWait !== true || dataType.endsWith('r2u')) return {}
    return { stream: this.host.streams.outgoing(label, !(store instanceof ConnectionCheckingStore)) }
  }

  private clearanceOf({ store }: Binding): Clearance {
    const label = store.robotConnector.connectorId
    return this.host.clearanceOf(this.catalogue?.entries.find((entry) => entry.label === label) ?? null)
  }

  private showBlock(binding: Binding): void {
    const { store } = binding
    if (isSending(store)) store.setSendBlock(this.clearanceOf(binding).block)
  }

  private portOpened(binding: Binding): void {
    if (!binding.ports.every((port) => port.isOpen)) return
    binding.store.attach(binding.ports)
    binding.store.notifyAfterConnected()
  }

  private portClosed(binding: Binding): void {
    this.closePorts(binding)
    binding.store.notifyAfterDisconnected({ code: 'peer.closed' })
  }

  private received(binding: Binding, port: DataPort, message: PortMessage): void {
    const deliver = (): void => this.deliver(binding, port, message)
    if (port.isNumbered) this.host.streams.arrived(port.label, message.seq, deliver)
    else deliver()
  }

  private deliver({ store }: Binding, port: DataPort, { data, seq, stampUs, latched }: PortMessage): void {
    this.host.valueArrived(port.label)
    const receivedAtMs = this.host.now()
    const ageMs = stampUs === 0 ? null : this.host.ageMs(stampUs, receivedAtMs)
    store.receive(data, { receivedAtMs, seq, stampUs, latched, ageMs }, port)
  }

  private bindTrack(binding: Binding): void {
    const { store } = binding
    const label = store.robotConnector.connectorId
    const track = this.isUp ? this.tracks.get(label) : undefined
    if (!track && this.isUp) this.host.lineMissing()
    if (!(store instanceof MediaStreamStore) || !track || store.mediaStream.get() === track.stream) return
    store.setMediaStream(track.stream, this.host.mediaSource(label, track.receiver))
    const origin = this.origins.get(label)
    if (origin) store.setOrigin(origin)
    store.notifyAfterConnected()
    this.watch(binding)
  }

  private watch(binding: Binding): void {
    if (!this.isGreeted || !(binding.store instanceof MediaStreamStore)) return
    const label = binding.store.robotConnector.connectorId
    // Sound is heard in a hidden tab too.
    const isHeard = this.catalogue?.entries.some((entry) => entry.label === label && entry.kind === 'audio') === true
    const wanted = (this.isVisible || isHeard) && binding.store.isWatched.get()
    if (wanted === binding.isWatching) return
    if (this.host.watch(label, wanted)) binding.isWatching = wanted
  }

  private unbind(binding: Binding): void {
    this.closePorts(binding)
    binding.isWatching = false
    if (binding.store instanceof MediaStreamStore) binding.store.setMediaStream(null)
    if (binding.store instanceof TalkStore) binding.store.connectLine(null)
  }

  private closePorts(binding: Binding): void {
    for (const port of binding.ports) port.close()
    binding.ports = []
    binding.carrier = null
    binding.store.detach()
  }
}

function isMediaStore(store: MosaicStore | undefined): boolean {
  return store instanceof MediaStreamStore || store instanceof TalkStore
}

function isSending(store: MosaicStore): store is SendableStore | BidirectionalStore {
  return store instanceof SendableStore || store instanceof BidirectionalStore
}
