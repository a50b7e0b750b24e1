import type { Catalogue, MediaOrigin, MediaTalking } from '@mosaic/protocol'
import { mediaLines } from './mediaLines'
import { nearestName } from '../words/nearestName'
import type { PictureReporter } from '../control/PictureReporter'
import type { ConnectionTimeline } from '../peers/ConnectionTimeline'
import type { FurtherOffers } from '../peers/FurtherOffers'
import type { LiveLink } from '../peers/LiveLink'
import type { MediaLine, MissingTrack, PeerLink } from '../peers/PeerLink'
import type { Platform } from '../platform/Platform'
import { receiverSource } from './receiverSource'
import { Value, type Readable } from '../platform/Readable'
import { MediaStreamStore, type MediaSource } from '../stores/MediaStreamStore'
import { labelOf } from '../stores/RobotStores'
import { TalkStore, type Talker } from '../stores/TalkStore'
import type { StoreState } from '../words/types'

/** What pictures and sound stand on. */
export interface MediaSurroundings {
  readonly platform: Pick<Platform, 'now' | 'isVisible'>
  readonly link: LiveLink
  /** Told of the first picture. */
  readonly record: Pick<ConnectionTimeline, 'mark'>
  readonly offers: Pick<FurtherOffers, 'want'>
  readonly pictures: PictureReporter
}

export type MediaStore = MediaStreamStore | TalkStore

interface Watch {
  /** The robot was asked for it. */
  isOn: boolean
  end(): void
}

interface Track {
  stream: MediaStream
  receiver: RTCRtpReceiver
}

/** Binds the pictures, sound and voices of one robot to the lines of the link, and asks for what is watched. */
export class MediaBindings {
  private readonly stores = new Map<string, MediaStore>()
  private readonly watches = new Map<MediaStreamStore, Watch>()
  private readonly tracks = new Map<string, Track>()
  private readonly origins = new Map<string, MediaOrigin>()
  private readonly talkers = new Map<string, Talker | null>()
  /** Once it is up. */
  private link: PeerLink | null = null
  private isGreeted = false

  private isOriginal = false
  private readonly arrived = new Value<readonly string[]>([])

  catalogue: Catalogue | null = null
  isDescribed = false
  /** The labels of the pictures that the robot sends on the present link. */
  readonly arrivedLabels: Readable<readonly string[]> = this.arrived

  private isVisible: boolean

  constructor(private readonly around: MediaSurroundings) {
    this.isVisible = around.platform.isVisible()
  }

  add(store: MediaStore): void {
    this.stores.set(labelOf(store), store)
    if (!(store instanceof MediaStreamStore)) return
    const ends = [store.isWatched, store.isKept].map((wish) => wish.subscribe(() => this.watch(store)))
    ends.push(store.shown.subscribe(() => this.sizeChanged(store)))
    this.watches.set(store, { isOn: false, end: () => ends.forEach((end) => end()) })
  }

  remove(store: MediaStore): void {
    const watch = store instanceof MediaStreamStore ? this.watches.get(store) : undefined
    watch?.end()
    if (watch?.isOn) this.ask(labelOf(store), false)
    this.unbind(store)
    this.stores.delete(labelOf(store))
    if (store instanceof MediaStreamStore) this.watches.delete(store)
  }

  setVisible(isVisible: boolean): void {
    this.isVisible = isVisible
    this.watchAll()
  }

  /** The media lines to offer: one per media connector in the catalogue's order. */
  lines(): MediaLine[] {
    return mediaLines(this.catalogue, this.watches.size, this.isDescribed)
  }

  /** Ask for the lines that are not there, unless nobody wants one of them. */
  wantLines(): void {
    this.around.offers.want(this.missingLines())
  }

  private missingLines(): MediaLine[] {
    const { link } = this
    if (link === null || this.catalogue === null || !this.isGreeted || this.isOriginal || this.isDescribed) return []
    const isMissing = (label: string | null): boolean => label !== null && !link.hasLine(label) && !this.tracks.has(label)
    const missing = this.lines().filter(({ label }) => isMissing(label))
    return missing.some(({ label }) => label !== null && this.stores.has(label)) ? missing : []
  }

  /** It sends what it has without being asked: what has not come by now will not come. */
  robotIsOriginal(): void {
    this.isOriginal = true
  }

  /** Pictures can arrive. */
  linkUp(link: PeerLink): void {
    this.link = link
  }

  /** The robot said hello: pictures can be asked for. */
  greeted(): void {
    this.isGreeted = true
    this.watchAll()
    this.wantLines()
  }

  /** The link is gone; the stores stay. */
  dropLink(): void {
    this.link = null
    this.isGreeted = this.isOriginal = false
    this.tracks.clear()
    this.arrived.set([])
    this.origins.clear()
    this.talkers.clear()
    for (const store of this.stores.values()) this.unbind(store)
  }

  /** Give the store its line, if that is there. */
  bind(store: MediaStore): void {
    if (this.link === null) return
    if (store instanceof TalkStore) this.bindVoice(store, this.link)
    else this.bindTrack(store)
  }

  trackArrived(label: string, track: Track): void {
    this.tracks.set(label, track)
    this.arrived.set([...this.tracks.keys()])
    const store = this.stores.get(label)
    // A wish that came before the line was refused.
    if (store instanceof MediaStreamStore) this.forgetWish(store)
  }

  originKnown(origin: MediaOrigin): void {
    this.origins.set(origin.label, origin)
    const store = this.stores.get(origin.label)
    if (store instanceof MediaStreamStore) store.setOrigin(origin)
  }

  /** Who is heard on a loudspeaker now. */
  talkingChanged({ label, peerId, name }: MediaTalking): void {
    const talker = peerId === undefined ? null : { peerId, name }
    this.talkers.set(label, talker)
    const store = this.stores.get(label)
    if (store instanceof TalkStore) store.talkingChanged(talker)
  }

  private bindVoice(store: TalkStore, link: PeerLink): void {
    const line = link.voiceOf(labelOf(store))
    if (line === null) {
      store.setState({ phase: 'closed', code: 'media.no_line' })
      return this.wantLines()
    }
    if (!store.connectLine(line)) return
    store.talkingChanged(this.talkers.get(labelOf(store)) ?? null)
    store.notifyAfterConnected()
  }

  private bindTrack(store: MediaStreamStore): void {
    const label = labelOf(store)
    const track = this.tracks.get(label)
    if (!track) return this.trackMissing(store)
    if (store.mediaStream.get() === track.stream) return
    store.setMediaStream(track.stream, this.sourceOf(label, track.receiver))
    const origin = this.origins.get(label)
    if (origin) store.setOrigin(origin)
    store.notifyAfterConnected()
    this.watch(store)
  }

  /** Why it is not there, where that is known; the robot's own word may follow. */
  private trackMissing(store: MediaStreamStore): void {
    const why = this.link?.missing(labelOf(store), this.isOriginal) ?? null
    if (why === null) return this.wantLines()
    store.setState(noPicture(why, labelOf(store), this.arrived.get()))
  }

  private unbind(store: MediaStore): void {
    if (store instanceof TalkStore) return void store.connectLine(null)
    this.forgetWish(store)
    store.setMediaStream(null)
  }

  private forgetWish(store: MediaStreamStore): void {
    const watch = this.watches.get(store)
    if (watch) watch.isOn = false
  }

  private watchAll(): void {
    for (const store of this.watches.keys()) this.watch(store)
  }

  private watch(store: MediaStreamStore): void {
    const watch = this.watches.get(store)
    if (!this.isGreeted || !watch) return
    const label = labelOf(store)
    // Sound is heard in a hidden tab too.
    const isWanted = store.isKept.get() || ((this.isVisible || this.isSound(label)) && store.isWatched.get())
    if (isWanted !== watch.isOn && this.ask(label, isWanted)) watch.isOn = isWanted
  }

  /** A robot that knows nothing of sizes is only told again what it knows. */
  private sizeChanged(store: MediaStreamStore): void {
    if (this.watches.get(store)?.isOn === true) this.say(labelOf(store), true)
  }

  /** Ask the robot for a picture, or to stop; false while that can't be said. */
  private ask(label: string, on: boolean): boolean {
    const isSaid = this.say(label, on)
    // Nobody drives by sound: its age slows nothing down.
    if (isSaid && !this.isSound(label)) this.around.pictures.watching(label, on)
    return isSaid
  }

  private say(label: string, on: boolean): boolean {
    const store = this.stores.get(label)
    const shown = on && store instanceof MediaStreamStore ? store.shown.get() : null
    const size = shown === null ? {} : { shownPx: Math.round(shown.sizePx), leads: shown.leads }
    return this.around.link.send('media.watch', { label, on, ...size })
  }

  private isSound(label: string): boolean {
    return this.catalogue?.entries.some((entry) => entry.label === label && entry.kind === 'audio') === true
  }

  private sourceOf(label: string, receiver: RTCRtpReceiver): MediaSource {
    const { platform, link, record, pictures } = this.around
    const shown = (rtpTimestamp: number, atMs: number): void => {
      record.mark('frame', atMs, label)
      pictures.seen(label, rtpTimestamp, atMs)
    }
    return receiverSource(receiver, { clock: platform, link, shown })
  }
}

function noPicture(why: MissingTrack, label: string, arrived: readonly string[]): StoreState {
  if (why === 'sdp.no_common_codec') return { phase: 'closed', code: why }
  if (why === 'media.no_line') return { phase: 'closed', code: why, message: 'An original robot was asked for fewer pictures: reload the page to see this one' }
  const nearest = nearestName(label, arrived)
  const others = arrived.length === 0 ? 'it sends none' : `it sends: ${arrived.join(', ')}`
  const guess = nearest === null ? '' : `; did you mean '${nearest}'?`
  return { phase: 'closed', code: 'channel.unknown_label', message: `The robot sends no picture '${label}' (${others})${guess}` }
}
