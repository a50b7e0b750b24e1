import type { ControlMessage, Refusal, Resume } from '@mosaic/protocol'
import { BulkConnection, type IceSource } from './peers/BulkConnection'
import type { ConnectionTimeline } from './peers/ConnectionTimeline'
import { ControlDesk } from './control/ControlDesk'
import { PictureReporter } from './control/PictureReporter'
import { DeliveryWatch } from './delivery/DeliveryWatch'
import { KnownCatalogue } from './bindings/KnownCatalogue'
import { FurtherOffers } from './peers/FurtherOffers'
import type { LiveLink } from './peers/LiveLink'
import { NearPath } from './peers/NearPath'
import type { Platform } from './platform/Platform'
import { Listeners } from './platform/Readable'
import { SessionStreams } from './resume/SessionStreams'
import { StoreBindings } from './bindings/StoreBindings'
import { RobotStores } from './stores/RobotStores'

/** What a conversation stands on. */
export interface ConversationSurroundings {
  readonly platform: Platform
  readonly link: LiveLink
  /** Told of the first value and the first picture. */
  readonly record: ConnectionTimeline
  /** For the second peer connection. */
  readonly ice: IceSource
}

/**
 * Holds what this page and a robot have with each other, whichever attempt carries it: stores, control, pictures, the connection
 * of bulk data. It hears the robot's words and outlives every link; `RobotConnection` makes the links.
 */
export class RobotConversation {
  readonly stores: StoreBindings
  readonly control: ControlDesk
  readonly bulk: BulkConnection
  readonly known = new KnownCatalogue()
  readonly nearPath = new NearPath()
  readonly delivery: DeliveryWatch
  readonly refused = new Listeners<[Refusal]>()
  private readonly streams: SessionStreams
  private readonly pictures: PictureReporter
  private readonly offers: FurtherOffers

  constructor(private readonly around: ConversationSurroundings) {
    const { platform, link, record, ice } = around
    const { known } = this
    const stores = new RobotStores()
    this.delivery = new DeliveryWatch((watch) => link.send('delivery.watch', watch))
    this.streams = new SessionStreams(platform, link)
    this.bulk = new BulkConnection(platform, link, ice)
    this.offers = new FurtherOffers(platform, link)
    this.pictures = new PictureReporter(platform, link)
    this.control = new ControlDesk({ platform, link, known, senders: stores })
    const { streams, bulk, offers, pictures, control } = this
    this.stores = new StoreBindings({ platform, link, record, stores, streams, bulk, offers, pictures, control })
    known.value.subscribe(() => this.catalogueChanged())
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
        this.around.record.mark('catalogue', this.around.platform.now())
        return this.known.learn(message.data.catalogue)
      case 'renegotiate.answer':
        return this.offers.heard(message.data)
      case 'lane.answer':
      case 'lane.candidate':
      case 'lane.close':
        return this.bulk.heard(message)
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
        return this.nearPath.told(message.data.urls, () => this.around.link.remoteAddress())
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
    this.bulk.drop()
    this.offers.close()
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

  private greeted(extensions: Record<string, number>): void {
    this.known.greeted()
    this.control.greeted(extensions)
    this.streams.greeted(extensions)
    this.delivery.greeted(extensions)
    this.bulk.greeted('bulkLane' in extensions)
    const { attempt } = this.around.link
    if ('renegotiate' in extensions && attempt !== null) this.offers.greeted(attempt.link)
  }
}
