import type { CatalogueEntry, ControlMessage, IceServer, Refusal, Resume } from '@mosaic/protocol'
import { BulkConnection } from './peers/BulkConnection'
import type { ConnectionTimeline } from './peers/ConnectionTimeline'
import { ControlDesk } from './control/ControlDesk'
import { PictureReporter } from './control/PictureReporter'
import { DeliveryWatch } from './delivery/DeliveryWatch'
import { KnownCatalogue } from './bindings/KnownCatalogue'
import { bindingHost, deskSurroundings, pictureSurroundings, type Live } from './liveSurroundings'
import { FurtherOffers } from './peers/FurtherOffers'
import { NearPath } from './peers/NearPath'
import type { Platform } from './platform/Platform'
import { Listeners } from './platform/Readable'
import { SessionStreams } from './resume/SessionStreams'
import { StoreBindings, type BindingHost } from './bindings/StoreBindings'

export interface ConversationOptions {
  platform: Platform
  live: Live
  /** Told of the first value and the first picture. */
  record: ConnectionTimeline
  /** For the lane. */
  iceServers: () => Promise<readonly IceServer[]>
}

/**
 * What this page and a robot have with each other, whichever attempt carries it: stores, control, pictures, the bulk
 * lane. It hears the robot's words and outlives every link; `RobotConnection` makes the links.
 */
export class RobotConversation {
  readonly stores: StoreBindings
  readonly control: ControlDesk
  readonly lane: BulkConnection
  readonly known = new KnownCatalogue()
  readonly nearPath = new NearPath()
  readonly delivery: DeliveryWatch
  readonly refused = new Listeners<[Refusal]>()
  private readonly streams: SessionStreams
  private readonly pictures: PictureReporter
  private more: FurtherOffers | null = null

  constructor(private readonly around: ConversationOptions) {
    const { platform, live } = around
    const entryOf = (label: string): CatalogueEntry | null => this.known.entryOf(label)
    this.delivery = new DeliveryWatch((watch) => live.attempt()?.control.send('delivery.watch', watch) ?? false)
    this.streams = new SessionStreams({
      now: () => platform.now(),
      tell: (delivered) => live.attempt()?.control.send('delivered', delivered),
      missed: (label, lost, sent) => this.stores.missed(label, lost, sent),
    })
    this.lane = new BulkConnection(platform, {
      iceServers: around.iceServers,
      send: (type, data) => live.attempt()?.control.send(type, data) ?? false,
      changed: (lost) => this.stores.laneChanged(lost),
    })
    this.stores = new StoreBindings(this.storesHost(), platform.isVisible())
    this.control = new ControlDesk(
      {
        ...deskSurroundings(platform, live, entryOf),
        sendOn: (label, text) => this.stores.sendOn(label, text),
        hasSentOn: (label) => this.stores.hasSentOn(label),
      },
      () => this.stores.showBlocks(),
    )
    this.pictures = new PictureReporter(pictureSurroundings(platform, live))
    this.known.value.subscribe(() => this.catalogueChanged())
  }

  visibilityChanged(isVisible: boolean): void {
    this.stores.media.setVisible(isVisible)
    this.control.visibilityChanged(isVisible)
  }

  /** A picture is on the screen. */
  pictureSeen(label: string, rtpTimestamp: number, atMs: number): void {
    this.pictures.seen(label, rtpTimestamp, atMs)
  }

  /** How far the reliable channels are: the robot hears it right after hello. */
  resumeWord(): Resume {
    return this.streams.word()
  }

  /** The robot said nothing that an original one would not say. */
  treatAsOriginal(): void {
    this.control.original()
    this.streams.plain()
    this.stores.treatAsOriginal()
  }

  /** A word of the robot on the control channel. `isGreeted`: it is known to be one of ours. */
  heard(message: ControlMessage, isGreeted: boolean): void {
    switch (message.type) {
      case 'hello':
        // Too late: both sides take each other for originals by now.
        if (isGreeted) this.greeted(message.data.extensions)
        return this.stores.media.greeted()
      case 'catalogue':
        this.mark('catalogue')
        return this.known.learn(message.data.catalogue)
      case 'renegotiate.answer':
        return this.more?.heard(message.data)
      case 'lane.answer':
      case 'lane.candidate':
      case 'lane.close':
        return this.lane.heard(message)
      case 'resume':
        return this.streams.resumed(message.data)
      case 'delivery.report':
        return this.delivery.heard(message.data)
      case 'delivered':
        return this.streams.delivered(message.data)
      case 'media.origin':
        this.pictures.originKnown(message.data)
        return this.stores.media.originKnown(message.data)
      case 'media.talking':
        return this.stores.media.talkingChanged(message.data)
      case 'media.unavailable':
        return this.stores.mediaUnavailable(message.data)
      case 'near':
        return this.nearPath.told(message.data.urls, () => this.remoteAddress())
      case 'refusal':
        this.stores.refused(message.data)
        this.control.heard(message)
        return this.refused.tell(message.data)
      default:
        this.control.heard(message)
    }
  }

  /** The link is gone. `onPurpose`: the robot is told so, and nobody will come back for what was kept. */
  linkLost(onPurpose: boolean): void {
    this.control.linkLost(onPurpose)
    this.pictures.clear()
    this.lane.drop()
    this.more?.close()
    this.more = null
    this.delivery.lost()
    this.nearPath.forget()
    if (onPurpose) this.streams.close()
    else this.streams.lost()
    this.stores.dropLink()
    this.known.fallBack()
  }

  /** Ended on purpose while there was no link. */
  closed(): void {
    this.control.linkLost(true)
    this.streams.close()
  }

  /** It won't come back by itself. */
  failed(why: { code: string; message?: string }): void {
    this.control.gaveUp(why)
    this.streams.close()
    this.stores.tellFailed(why)
  }

  private catalogueChanged(): void {
    const catalogue = this.known.value.get()
    this.stores.setCatalogue(catalogue, this.known.described.get())
    this.control.setDescribed(this.known.described.get() ? (catalogue?.entries ?? []) : null)
  }

  private storesHost(): BindingHost {
    const { platform, live } = this.around
    return bindingHost(platform, live, {
      watch: (label, on) => this.watch(label, on),
      clearanceOf: (entry) => this.control.clearanceOf(entry),
      lineMissing: () => this.more?.look(),
      bulkCarrier: (main) => (this.lane.settled() ? (this.lane.link ?? main) : null),
      streams: this.streams,
      shown: (label, rtpTimestamp, atMs) => {
        this.around.record.mark('frame', atMs, label)
        this.pictureSeen(label, rtpTimestamp, atMs)
      },
      valueArrived: (label) => this.mark('value', label),
    })
  }

  private greeted(extensions: Record<string, number>): void {
    this.known.greeted()
    this.control.greeted(extensions)
    this.streams.greeted(extensions)
    this.delivery.greeted(extensions)
    this.lane.greeted('bulkLane' in extensions)
    if ('renegotiate' in extensions) this.more ??= this.moreLines()
  }

  private remoteAddress(): Promise<string | null> {
    return this.around.live.attempt()?.link.remoteAddress() ?? Promise.resolve(null)
  }

  private moreLines(): FurtherOffers | null {
    const attempt = this.around.live.attempt()
    return attempt && new FurtherOffers(attempt.link, {
      send: (offer) => attempt.control.send('renegotiate.offer', offer),
      missing: () => this.stores.missingLines(),
      added: () => this.stores.linesAdded(),
    })
  }

  private watch(label: string, on: boolean): boolean {
    const isSaid = this.around.live.attempt()?.control.send('media.watch', { label, on }) ?? false
    // Nobody drives by sound: its age slows nothing down.
    if (isSaid && this.known.entryOf(label)?.kind !== 'audio') this.pictures.watching(label, on)
    return isSaid
  }

  private mark(moment: 'catalogue' | 'value', detail?: string): void {
    this.around.record.mark(moment, this.around.platform.now(), detail)
  }
}
