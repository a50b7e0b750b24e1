import type { Catalogue, CatalogueEntry, MediaUnavailable, Refusal } from '@mosaic/protocol'
import { channelPlan, NOT_MEDIA } from './channelPlan'
import type { Clearance } from '../control/clearance'
import { ChannelPartials } from '../delivery/ChannelPartials'
import type { ControlDesk } from '../control/ControlDesk'
import { MediaBindings, type MediaStore, type MediaSurroundings } from './MediaBindings'
import type { BulkConnection, ChannelCarrier } from '../peers/BulkConnection'
import type { FurtherOffers } from '../peers/FurtherOffers'
import type { PeerLink } from '../peers/PeerLink'
import { StorePorts, type PortsSurroundings } from './StorePorts'
import { MediaStreamStore } from '../stores/MediaStreamStore'
import type { MosaicStore } from '../stores/MosaicStore'
import { isSending, labelOf, type RobotStores } from '../stores/RobotStores'
import { TalkStore } from '../stores/TalkStore'
import { entryFor } from '../words/entryFor'

/** What the bindings stand on. */
export interface BindingSurroundings extends MediaSurroundings, Omit<PortsSurroundings, 'link' | 'platform' | 'partials' | 'clearance'> {
  readonly bulk: BulkConnection
  readonly offers: FurtherOffers
  readonly control: ControlDesk
  /** Those that are bound here. */
  readonly stores: RobotStores
}

interface Binding {
  store: MosaicStore
  ports: StorePorts
}

type Why = { code?: string; message?: string }

/** Binds the stores of one robot to what carries them: channels and tracks of the peer link, while there is one. */
export class StoreBindings {
  readonly media: MediaBindings
  private readonly bindings = new Map<string, Binding>()
  private readonly partials: ChannelPartials
  private link: PeerLink | null = null
  private catalogue: Catalogue | null = null
  private isDescribed = false
  private wasSilent = false

  constructor(private readonly around: BindingSurroundings) {
    const { platform, streams, bulk, offers, control } = around
    this.partials = new ChannelPartials(() => platform.now())
    this.media = new MediaBindings(around)
    streams.missed.add((label, lost, sent) => this.missed(label, lost, sent))
    bulk.changed.add((lost) => this.bulkMoved(lost))
    offers.added.add(() => this.linesAdded())
    control.changed.add(() => this.showBlocks())
  }

  add(store: MosaicStore): void {
    const { partials } = this
    const ports = new StorePorts(store, { ...this.around, partials, clearance: () => this.clearanceOf(store) })
    const binding: Binding = { store, ports }
    this.bindings.set(labelOf(store), binding)
    this.around.stores.add(store)
    if (isMedia(store)) this.media.add(store)
    if (this.link) store.notifyBeforeConnected()
    this.bind(binding)
    this.showBlock(binding)
  }

  remove(store: MosaicStore): void {
    const binding = this.bindings.get(labelOf(store))
    if (binding?.store !== store) return
    this.bindings.delete(labelOf(store))
    this.around.stores.remove(store)
    if (isMedia(store)) this.media.remove(store)
    binding.ports.release()
  }

  /** The robot's connectors changed, or became known. `isDescribed`: people said so of a robot that says nothing. */
  setCatalogue(catalogue: Catalogue | null, isDescribed = false): void {
    const wasOriginal = this.isOriginal
    const changed = changedLabels(this.catalogue, catalogue)
    this.catalogue = this.media.catalogue = catalogue
    this.isDescribed = this.media.isDescribed = isDescribed
    if (wasOriginal && !this.wasSilent && !isDescribed) for (const { ports } of this.bindings.values()) ports.close()
    for (const [label, { ports }] of this.bindings) if (changed.has(label)) ports.release()
    this.bindAll()
    this.media.wantLines()
    this.showBlocks()
  }

  /** A new attempt begins. */
  begin(): void {
    for (const { store } of this.bindings.values()) store.notifyBeforeConnected()
  }

  /** There is a link: open the channels that are known to be needed. */
  setLink(link: PeerLink): void {
    this.link = link
    this.wasSilent = false
    this.bindAll()
  }

  /** The link is up: pictures can arrive. */
  linkUp(): void {
    if (this.link) this.media.linkUp(this.link)
    this.bindAll()
  }

  /** The robot is an original one: channels carry bare payloads, and every picture is sent anyway. */
  treatAsOriginal(): void {
    const wasOriginal = this.isOriginal
    this.wasSilent = true
    this.media.robotIsOriginal()
    for (const binding of this.bindings.values()) {
      // Its channels are bare already, and it would not heed their labels a second time.
      if (!wasOriginal) binding.ports.close()
      this.bind(binding)
    }
  }

  /** The link is gone; the stores stay. */
  dropLink(): void {
    if (this.link === null) return
    this.link = null
    this.media.dropLink()
    for (const { ports } of this.bindings.values()) ports.close()
  }

  tellDisconnected(why: Why): void {
    for (const store of this.matching) store.notifyAfterDisconnected(why)
  }

  /** It was lost and is being made anew. */
  tellInterrupted(why: Why): void {
    for (const store of this.matching) store.notifyInterrupted(why)
  }

  tellFailed(why: Why & { code: string }): void {
    for (const store of this.matching) store.notifyAfterConnectionFailed(why)
  }

  trackArrived(label: string, stream: MediaStream, receiver: RTCRtpReceiver): void {
    this.media.trackArrived(label, { stream, receiver })
    const binding = this.bindings.get(label)
    if (binding) this.bind(binding)
  }

  mediaUnavailable({ label, code, message }: MediaUnavailable): void {
    const store = this.bindings.get(label)?.store
    if (store) store.setState(message === undefined ? { phase: 'closed', code } : { phase: 'closed', code, message })
  }

  refused(refusal: Refusal): void {
    for (const { store, ports } of this.bindings.values()) {
      if (store instanceof TalkStore && labelOf(store) === refusal.label) store.refused(refusal)
      if (ports.has(refusal.label) && isSending(store)) store.refused(refusal)
    }
  }

  /** Those whose connector the robot has, as far as anybody knows. */
  private get matching(): MosaicStore[] {
    const stores = [...this.bindings.values()].map(({ store }) => store)
    return stores.filter((store) => store.state.get().phase !== 'mismatch')
  }

  /** A robot that is silent, or of which only people speak: channels carry bare payloads. */
  private get isOriginal(): boolean {
    return this.wasSilent || this.isDescribed
  }

  /** Messages of this channel are lost. */
  private missed(label: string, lost: number | null, sent: boolean): void {
    for (const { store, ports } of this.bindings.values()) {
      const isMeant = labelOf(store) === label || ports.has(label)
      if (isMeant) store.missed({ lost, sent, atMs: this.around.platform.now() })
    }
  }

  /** Bulk goes elsewhere from now on; what was carried by `lost` opens anew. */
  private bulkMoved(lost: ChannelCarrier | null): void {
    for (const binding of this.bindings.values()) {
      if (lost !== null && binding.ports.isOn(lost)) binding.ports.lost()
      this.bind(binding)
    }
  }

  private linesAdded(): void {
    this.bindAll()
    this.media.wantLines()
  }

  /** Who may send what may have changed. */
  private showBlocks(): void {
    for (const binding of this.bindings.values()) this.showBlock(binding)
  }

  private bindAll(): void {
    for (const binding of this.bindings.values()) this.bind(binding)
  }

  private bind({ store, ports }: Binding): void {
    const { catalogue, isOriginal } = this
    const plan = channelPlan(store.robotConnector, { catalogue, isOriginal, bare: store.bareChannels() })
    if (plan.type === 'mismatch') store.setState(plan.state)
    else if (plan.type === 'media' && !isMedia(store)) store.setState(NOT_MEDIA)
    else if (store.state.get().phase === 'mismatch') store.setState({ phase: 'waiting' })
    if (plan.type === 'mismatch') ports.close()
    if (plan.type === 'media' && isMedia(store)) this.media.bind(store)
    else if (plan.type === 'channels' && this.link) ports.open(this.link, plan, isOriginal)
  }

  private clearanceOf(store: MosaicStore): Clearance {
    return this.around.control.clearanceOf(entryFor(this.catalogue, labelOf(store)))
  }

  private showBlock({ store }: Binding): void {
    if (isSending(store)) store.setSendBlock(this.clearanceOf(store).block)
  }
}

/** The labels whose channels carry something else than before. What comes or goes opens or closes by itself. */
function changedLabels(before: Catalogue | null, after: Catalogue | null): Set<string> {
  const shapes = new Map(before?.entries.map((entry) => [entry.label, shape(entry)]))
  const differs = (entry: CatalogueEntry): boolean => (shapes.get(entry.label) ?? shape(entry)) !== shape(entry)
  return new Set(after?.entries.filter(differs).map(({ label }) => label))
}

function shape({ type, dataType, direction, delivery, channels }: CatalogueEntry): string {
  return JSON.stringify([type, dataType, direction, delivery, channels])
}

function isMedia(store: MosaicStore): store is MediaStore {
  return store instanceof MediaStreamStore || store instanceof TalkStore
}
