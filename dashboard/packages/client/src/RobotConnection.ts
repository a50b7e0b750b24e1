import {
  RobotStatus,
  type Catalogue,
  type CatalogueEntry,
  type ControlMessage,
  type IceServer,
  type Refusal,
  type SignalingMessage,
} from '@mosaic/protocol'
import { BulkLane, type BulkLaneState } from './BulkLane'
import { isAbout, reasonIn } from './connectionWords'
import { ControlDesk } from './control/ControlDesk'
import { PictureReporter } from './control/PictureReporter'
import { DeliveryWatch } from './delivery/DeliveryWatch'
import { KnownCatalogue } from './KnownCatalogue'
import { bindingHost, deskSurroundings, pictureSurroundings, type Live } from './liveSurroundings'
import { MoreLines } from './MoreLines'
import { MosaicError } from './MosaicError'
import { NearPath } from './NearPath'
import { PeerAttempt } from './PeerAttempt'
import { pathText } from './chosenPath'
import { ConnectionTimeline, type Timeline } from './ConnectionTimeline'
import type { PeerEffect, PeerEvent } from './peerEvents'
import { PeerSession } from './peerSession'
import type { Platform } from './Platform'
import { Listeners, Value, type Readable } from './Readable'
import { SessionStreams } from './resume/SessionStreams'
import type { RestApi } from './RestApi'
import type { SessionIds } from './SessionIds'
import type { SignalingSocket } from './SignalingSocket'
import { StoreBindings } from './StoreBindings'
import type { StoreHost } from './StoreManager'
import type { MosaicStore } from './stores/MosaicStore'
import type { ConnectionState } from './types'

/** How long the lane waits for the server's fresh credentials. */
const FRESH_ICE_MS = 1000

/** A timer this late was not held up, the machine was asleep. */
const SLEPT_MS = 3000

export interface ConnectionSurroundings {
  platform: Platform
  api: RestApi
  socket: SignalingSocket
  sessionIds: SessionIds
}

/**
 * The one connection of this page to one robot. It comes back by itself after a loss, with the same session, until
 * `disconnect`; the stores of the robot live through that. `PeerSession` decides, this carries it out.
 */
export class RobotConnection implements StoreHost {
  private readonly session = new PeerSession()
  private readonly bindings: StoreBindings
  private readonly streams: SessionStreams
  private readonly pictures: PictureReporter
  private readonly lane: BulkLane
  private readonly status = new Value<ConnectionState>({ phase: 'idle', roundTripMs: null })
  private readonly known = new KnownCatalogue()
  private readonly nearPath = new NearPath()
  private readonly refused = new Listeners<[Refusal]>()
  private readonly record = new ConnectionTimeline()
  private robotStatus: RobotStatus | null = null
  private attempt: PeerAttempt | null = null
  private iceServers: readonly IceServer[] = []
  private more: MoreLines | null = null
  /** Counts attempts, so that what an abandoned one still receives is recognized. */
  private attemptNumber = 0
  private timer: ReturnType<typeof setTimeout> | null = null

  /** Who commands the robot, its stop, its limits. */
  readonly control: ControlDesk
  readonly state: Readable<ConnectionState> = this.status
  /** Short form from the server, full (with message schemas) once connected. */
  readonly catalogue: Readable<Catalogue | null> = this.known.value
  /** Where this robot serves the same page itself, if this page is on its network; the present path first. */
  readonly near: Readable<readonly string[]> = this.nearPath.value
  /** What happened when between the click and the first picture, of the newest attempt; null before one. */
  readonly timeline: Readable<Timeline | null> = this.record.view
  /** How the robot's data travels, while anybody asks; what a store itself got and sent is its `counters`. */
  readonly delivery = new DeliveryWatch((watch) => this.attempt?.control.send('delivery.watch', watch) ?? false)
  /** The second peer connection, for connectors with delivery `bulk`. */
  readonly bulkLane: Readable<BulkLaneState>
  /** The last attempt that failed, until one comes up. */
  readonly failedTimeline: Readable<Timeline | null> = this.record.failed
  /** Messages that the robot did not accept. */
  readonly refusals = { subscribe: (listener: (refusal: Refusal) => void): (() => void) => this.refused.add(listener) }

  constructor(
    readonly robotId: string,
    private readonly around: ConnectionSurroundings,
  ) {
    const { platform, socket } = around
    const live: Live = {
      attempt: () => this.attempt,
      phase: () => this.session.publicPhase,
      entryOf: (label) => this.entryOf(label),
    }
    this.streams = new SessionStreams({
      now: () => platform.now(),
      tell: (delivered) => this.attempt?.control.send('delivered', delivered),
      missed: (label, lost, sent) => this.bindings.missed(label, lost, sent),
    })
    const host = bindingHost(platform, live, {
      watch: (label, on) => this.watch(label, on),
      clearanceOf: (entry) => this.control.clearanceOf(entry),
      lineMissing: () => this.more?.look(),
      bulkCarrier: (main) => (this.lane.settled() ? (this.lane.link ?? main) : null),
      streams: this.streams,
      shown: (label, rtpTimestamp, atMs) => {
        this.record.mark('frame', atMs, label)
        this.pictureSeen(label, rtpTimestamp, atMs)
      },
      valueArrived: (label) => this.record.mark('value', platform.now(), label),
    })
    this.lane = new BulkLane(platform, {
      iceServers: () => this.freshIceServers(),
      send: (type, data) => this.attempt?.control.send(type, data) ?? false,
      changed: (lost) => this.bindings.laneChanged(lost),
    })
    this.bulkLane = this.lane.state
    this.bindings = new StoreBindings(host, platform.isVisible())
    this.control = new ControlDesk(deskSurroundings(platform, live), () => this.bindings.showBlocks())
    this.pictures = new PictureReporter(pictureSurroundings(platform, live))
    this.catalogue.subscribe(() => this.bindings.setCatalogue(this.catalogue.get()))
    platform.onVisibilityChange(() => {
      this.bindings.setVisible(platform.isVisible())
      this.control.visibilityChanged(platform.isVisible())
    })
    platform.onPageHide(() => this.handle({ type: 'pageHidden' }))
    platform.onPageShow(() => this.handle({ type: 'pageShown' }))
    platform.onNetworkChange(() => this.doubt())
    socket.onMessage((message) => this.signaled(message))
    socket.state.subscribe(() => this.serverChanged())
  }

  /** Connect and stay connected until `disconnect`; repeated calls do nothing, after a failure one tries again. */
  connect(): void {
    this.handle({ type: 'connectWanted' })
  }

  /** End the connection; the robot is told. */
  disconnect(): void {
    this.handle({ type: 'disconnectWanted' })
  }

  /** What the robot's catalogue says of this label; null while unknown. */
  entryOf(label: string): CatalogueEntry | null {
    return this.known.entryOf(label)
  }

  /**
   * The picture with this RTP timestamp is on the screen (`MediaStreamStore.pictureShown` says so by itself): the robot
   * is told how old it is.
   */
  pictureSeen(label: string, rtpTimestamp: number, atMs = this.around.platform.now()): void {
    this.pictures.seen(label, rtpTimestamp, atMs)
  }

  /** Called by the `StoreManager`. */
  addStore(store: MosaicStore): void {
    this.bindings.add(store)
  }

  /** Called by the `StoreManager`. */
  removeStore(store: MosaicStore): void {
    this.bindings.remove(store)
  }

  /** Called by the client: the short catalogue from the server. A live robot's own word counts more. */
  announced(catalogue: Catalogue): void {
    this.known.announced(catalogue, this.session.phase === 'up')
  }

  private watch(label: string, on: boolean): boolean {
    const isSaid = this.attempt?.control.send('media.watch', { label, on }) ?? false
    // Nobody drives by sound: its age slows nothing down.
    if (isSaid && this.entryOf(label)?.kind !== 'audio') this.pictures.watching(label, on)
    return isSaid
  }

  private handle(event: PeerEvent): void {
    const { platform } = this.around
    this.record.heard(event, platform.now())
    if (event.type === 'iceConnected') void this.explainPath()
    const effects = this.session.handle(event, platform.now(), platform.random())
    // Set first, so that whoever is told below sees the new state.
    this.publish()
    for (const effect of effects) this.carryOut(effect)
    this.schedule()
  }

  private publish(): void {
    const now = this.status.get()
    const phase = this.session.publicPhase
    const { code, message } = this.session.reason
    const roundTripMs = phase === 'connected' ? (this.attempt?.control.clocks.roundTripMs ?? null) : null
    const isSame = now.phase === phase && now.code === code && now.message === message
    if (!isSame || now.roundTripMs !== roundTripMs) this.status.set({ phase, roundTripMs, ...reasonIn({ code, message }) })
  }

  private schedule(): void {
    if (this.timer !== null) clearTimeout(this.timer)
    const atMs = this.session.wakeAtMs
    const tick = (): void => this.ticked(atMs ?? 0)
    this.timer = atMs === null ? null : setTimeout(tick, Math.max(0, atMs - this.around.platform.now()))
  }

  private ticked(dueAtMs: number): void {
    // The machine slept: whatever was connected is probably gone.
    if (this.around.platform.now() - dueAtMs > SLEPT_MS) {
      this.around.socket.doubt()
      this.doubt()
    }
    this.handle({ type: 'ticked' })
  }

  private doubt(): void {
    if (this.attempt) this.handle({ type: 'doubted', patienceMs: this.attempt.patienceMs })
  }

  private carryOut(effect: PeerEffect): void {
    switch (effect.type) {
      case 'request':
        this.record.begin(this.around.platform.now())
        this.bindings.begin()
        return this.requestIfOnline()
      case 'makeOffer':
        return void this.attempt?.offer(this.bindings.mediaLines())
      case 'sendHello':
        return this.attempt?.control.sendHello(this.streams.word())
      case 'sendPing':
        return this.attempt?.control.sendPing()
      case 'treatAsOriginal':
        this.control.original()
        this.streams.plain()
        return this.bindings.treatAsOriginal()
      case 'drop':
        return this.drop(effect.bye)
      case 'tellConnected':
        return this.bindings.linkUp()
      case 'tellDisconnected':
        // Closed between two attempts there was nothing to drop, but there is something to give up.
        if (this.session.phase === 'closed' || this.session.phase === 'suspended') {
          this.control.linkLost(true)
          this.streams.close()
        }
        if (this.session.publicPhase === 'reconnecting') {
          this.around.socket.doubt()
          return this.bindings.tellInterrupted(reasonIn(effect))
        }
        return this.bindings.tellDisconnected(reasonIn(effect))
      case 'tellFailed':
        this.control.gaveUp({ ...reasonIn(effect), code: effect.code })
        this.streams.close()
        return this.bindings.tellFailed({ ...reasonIn(effect), code: effect.code })
    }
  }

  private serverChanged(): void {
    if (this.around.socket.state.get() !== 'online') return
    if (this.session.phase === 'requesting') this.requestIfOnline()
    else this.handle({ type: 'robotReady' })
  }

  // The server connects only those whose socket it has; until then the phase's time-out runs.
  private requestIfOnline(): void {
    if (this.around.socket.state.get() === 'online') void this.request()
  }

  private async request(): Promise<void> {
    const number = ++this.attemptNumber
    const { api, sessionIds } = this.around
    try {
      const [grant, iceServers, catalogue] = await Promise.all([
        api.createConnection(this.robotId, sessionIds.of(this.robotId)),
        api.iceServers().catch((): IceServer[] => []),
        // Toward an original server there is none to be had.
        this.catalogue.get() === null ? api.catalogue(this.robotId).catch(() => null) : null,
      ])
      if (number !== this.attemptNumber) return
      if (grant.sessionId !== undefined) sessionIds.remember(this.robotId, grant.sessionId)
      if (catalogue) this.announced(catalogue)
      this.begin(grant.rtcSessionId, iceServers)
    } catch (error) {
      if (number === this.attemptNumber) this.broken(error)
    }
  }

  private moreLines(): MoreLines | null {
    const { attempt, bindings } = this
    return attempt && new MoreLines(attempt.link, {
      send: (offer) => attempt.control.send('renegotiate.offer', offer),
      missing: () => bindings.missingLines(),
      added: () => bindings.linesAdded(),
    })
  }

  // For the lane: the server need not be there, and the credentials of the main connection may still do.
  private freshIceServers(): Promise<readonly IceServer[]> {
    const known = this.iceServers
    if (known.length === 0) return Promise.resolve(known)
    const late = new Promise<readonly IceServer[]>((resolve) => setTimeout(() => resolve(known), FRESH_ICE_MS))
    return Promise.race([this.around.api.iceServers().catch(() => known), late])
  }

  private begin(rtcConnectionId: string, iceServers: readonly IceServer[]): void {
    const { platform, socket } = this.around
    this.iceServers = iceServers
    const options = { rtcConnectionId, iceServers, holdCandidates: this.catalogue.get() === null }
    this.attempt = new PeerAttempt(platform, socket, options, {
      happened: (event) => this.handle(event),
      controlHeard: (message) => this.controlHeard(message),
      laneOpened: () => this.control.linkUp(),
      trackArrived: (label, stream, receiver) => this.bindings.trackArrived(label, stream, receiver),
    })
    this.bindings.setLink(this.attempt.link)
    this.handle({ type: 'granted' })
  }

  private signaled(message: SignalingMessage): void {
    if (message.type === 'status.update' && message.data.robotId === this.robotId) this.statusChanged(message.data.status)
    const { attempt } = this
    if (!attempt || !isAbout(message, attempt.rtcConnectionId)) return
    if (message.type === 'signaling.send_sdp_answer') void attempt.answered(message.data.sdpAnswer)
    else if (message.type === 'signaling.exchange_ice_candidate') void attempt.link.addCandidate(message.data.iceCandidate)
    else if (message.type === 'signaling.close_peer_connection') {
      this.handle({ type: 'broken', code: 'peer.closed', ...reasonIn(message.data) })
    }
    this.candidateIn(message)
  }

  private candidateIn(message: SignalingMessage): void {
    const now = this.around.platform.now()
    if (message.type === 'signaling.exchange_ice_candidate') this.record.mark('candidate', now)
    else if (message.type === 'signaling.send_sdp_answer' && message.data.sdpAnswer.includes('\na=candidate:')) {
      this.record.mark('candidate', now, 'in the answer')
    }
  }

  private async explainPath(): Promise<void> {
    // Told afterwards, for people alone: a browser that can't say it is no problem.
    const path = await this.attempt?.link.path().catch(() => null)
    if (path) this.record.explain('ice', pathText(path))
  }

  // Only a robot that comes online is news: an original one passes 0 after every failed attempt.
  private statusChanged(status: RobotStatus): void {
    const wasOffline = this.robotStatus === RobotStatus.DISCONNECTED || this.robotStatus === RobotStatus.WS_CONNECTED
    this.robotStatus = status
    if (wasOffline && status === RobotStatus.READY_TO_CONNECT) this.handle({ type: 'robotReady' })
  }

  private controlHeard(message: ControlMessage | null): void {
    this.handle({ type: 'robotHeard' })
    switch (message?.type) {
      case 'hello':
        this.handle({ type: 'helloHeard' })
        // Too late: both sides take each other for originals by now.
        if (this.session.isGreeted) {
          this.control.greeted(message.data.extensions)
          this.streams.greeted(message.data.extensions)
          this.delivery.greeted(message.data.extensions)
          this.lane.greeted('bulkLane' in message.data.extensions)
          if ('renegotiate' in message.data.extensions) this.more ??= this.moreLines()
        }
        return this.bindings.greeted()
      case 'catalogue':
        this.record.mark('catalogue', this.around.platform.now())
        return this.known.learn(message.data.catalogue)
      case 'renegotiate.answer':
        return this.more?.heard(message.data)
      case 'lane.answer':
      case 'lane.candidate':
      case 'lane.close':
        return this.lane.heard(message)
      case 'bye':
        return this.handle({ type: 'broken', ...reasonIn(message.data), code: message.data.code })
      case 'resume':
        return this.streams.resumed(message.data)
      case 'delivery.report':
        return this.delivery.heard(message.data)
      case 'delivered':
        return this.streams.delivered(message.data)
      case 'media.origin':
        this.pictures.originKnown(message.data)
        return this.bindings.originKnown(message.data)
      case 'media.talking':
        return this.bindings.talkingChanged(message.data)
      case 'media.unavailable':
        return this.bindings.mediaUnavailable(message.data)
      case 'near':
        return this.nearPath.told(message.data.urls, () => this.attempt?.link.remoteAddress() ?? Promise.resolve(null))
      case 'refusal':
        this.bindings.refused(message.data)
        this.control.heard(message)
        return this.refused.tell(message.data)
      default:
        if (message) this.control.heard(message)
    }
  }

  private drop(bye: boolean): void {
    const { attempt } = this
    this.attemptNumber += 1
    this.attempt = null
    this.record.end(this.session.reason.code ?? 'peer.closed', this.around.platform.now())
    this.control.linkLost(bye)
    this.pictures.clear()
    this.lane.drop()
    this.more?.close()
    this.more = null
    this.delivery.lost()
    this.nearPath.forget()
    if (bye) this.streams.close()
    else this.streams.lost()
    if (attempt) {
      this.bindings.dropLink()
      attempt.close(bye)
    }
    this.known.fallBack()
  }

  // Nothing that we know of throws anything else than our own; a browser without WebRTC does.
  private broken(error: unknown): void {
    const code = error instanceof MosaicError ? error.code : 'sdp.invalid'
    this.handle({ type: 'broken', code, message: error instanceof MosaicError ? error.message : String(error) })
  }
}
