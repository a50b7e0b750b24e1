import type { Catalogue, MediaOrigin, MediaTalking } from '@mosaic/protocol'
import { mediaLines } from './mediaLines'
import { nearestName } from '../words/nearestName'
import type { MediaLine, MissingTrack, PeerLink } from '../peers/PeerLink'
import { Value, type Readable } from '../platform/Readable'
import { MediaStreamStore, type MediaSource } from '../stores/MediaStreamStore'
import { TalkStore, type Talker } from '../stores/TalkStore'
import type { StoreState } from '../words/types'

/** What pictures and sound need of the live connection. */
export interface MediaHost {
  /** Ask the robot for a picture, or to stop; false while that can't be said. */
  watch(label: string, on: boolean): boolean
  mediaSource(label: string, receiver: RTCRtpReceiver): MediaSource
  /** A connector of the catalogue has no media line. */
  lineMissing(): void
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

/** Pictures, sound and voices of one robot: which line of the link carries which store, and what is watched. */
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

  constructor(
    private readonly host: MediaHost,
    private isVisible: boolean,
  ) {}

  add(store: MediaStore): void {
    this.stores.set(labelOf(store), store)
    if (!(store instanceof MediaStreamStore)) return
    const ends = [store.isWatched, store.isKept].map((wish) => wish.subscribe(() => this.watch(store)))
    this.watches.set(store, { isOn: false, end: () => ends.forEach((end) => end()) })
  }

  remove(store: MediaStore): void {
    const watch = store instanceof MediaStreamStore ? this.watches.get(store) : undefined
    watch?.end()
    if (watch?.isOn) this.host.watch(labelOf(store), false)
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

  /** The lines that a further offer must add; none while nobody wants one of them. */
  missingLines(): MediaLine[] {
    const { link } = this
    if (link === null || this.catalogue === null || !this.isGreeted) return []
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
    this.host.lineMissing()
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
      return this.host.lineMissing()
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
    store.setMediaStream(track.stream, this.host.mediaSource(label, track.receiver))
    const origin = this.origins.get(label)
    if (origin) store.setOrigin(origin)
    store.notifyAfterConnected()
    this.watch(store)
  }

  /** Why it is not there, where that is known; the robot's own word may follow. */
  private trackMissing(store: MediaStreamStore): void {
    const why = this.link?.missing(labelOf(store), this.isOriginal) ?? null
    if (why === null) return this.host.lineMissing()
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
    const isHeard = this.catalogue?.entries.some((entry) => entry.label === label && entry.kind === 'audio') === true
    const isWanted = store.isKept.get() || ((this.isVisible || isHeard) && store.isWatched.get())
    if (isWanted !== watch.isOn && this.host.watch(label, isWanted)) watch.isOn = isWanted
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

function labelOf(store: MediaStore): string {
  return store.robotConnector.connectorId
}
