import {
  RobotStatus,
  type Catalogue,
  type CatalogueEntry,
  type ControlMessage,
  type IceServer,
  type Refusal,
  type SignalingMessage,
} from '@mosaic/protocol'
import type { BulkLaneState } from './peers/BulkConnection'
import { pathText } from './peers/chosenPath'
import { wallClockMs } from './timing/clock'
import { ConnectionRequest } from './signaling/ConnectionRequest'
import { ConnectionTimeline, type Timeline } from './peers/ConnectionTimeline'
import { reasonIn } from './words/connectionWords'
import type { ControlDesk } from './control/ControlDesk'
import { readConnectorConfig } from './described/connectorConfig'
import { describedCatalogue } from './described/describedCatalogue'
import type { DeliveryWatch } from './delivery/DeliveryWatch'
import { PeerAttempt } from './peers/PeerAttempt'
import type { PeerEffect, PeerEvent } from './peers/peerEvents'
import { OperatorPeerMachine } from './peers/peerOfOperator'
import type { Platform } from './platform/Platform'
import { Value, type Readable } from './platform/Readable'
import type { RestApi } from './signaling/RestApi'
import { RobotConversation } from './RobotConversation'
import type { SessionIds } from './signaling/SessionIds'
import type { SignalingSocket } from './signaling/SignalingSocket'
import { SleepWatch, SLEPT_MS } from './timing/SleepWatch'
import type { StoreHost } from './stores/StoreManager'
import type { MosaicStore } from './stores/MosaicStore'
import type { ConnectionState, RobotInfo } from './words/types'
import { WakeTimer } from './timing/WakeTimer'

/** How long the zeros for an original robot travel ahead of the server's word, which makes it listen to nothing more. */
const ZEROS_LEAVE_MS = 100

export interface ConnectionSurroundings {
  platform: Platform
  api: RestApi
  socket: SignalingSocket
  sessionIds: SessionIds
}

/**
 * The one connection of this page to one robot. It comes back by itself after a loss, with the same session, until
 * `disconnect`; the stores of the robot live through that. `OperatorPeerMachine` decides, this carries it out.
 */
export class RobotConnection implements StoreHost {
  private readonly session = new OperatorPeerMachine()
  private readonly conversation: RobotConversation
  private readonly request: ConnectionRequest
  private readonly status = new Value<ConnectionState>({ phase: 'idle', roundTripMs: null })
  private readonly record = new ConnectionTimeline()
  private readonly timer: WakeTimer
  private readonly sleep = new SleepWatch()
  private robotStatus: RobotStatus | null = null
  private attempt: PeerAttempt | null = null
  private config: string | null = null

  /** Who commands the robot, its stop, its limits. */
  readonly control: ControlDesk
  /** Where the connection stands, with the reason if there is one. */
  readonly state: Readable<ConnectionState> = this.status
  /** Short form from the server, full (with message schemas) once connected. */
  readonly catalogue: Readable<Catalogue | null>
  /** True where the catalogue is people's word: the robot announces nothing itself. */
  readonly isDescribed: Readable<boolean>
  /** The labels of the pictures that the robot sends, also those that nobody asked for: an original one sends them all. */
  readonly arrivedPictures: Readable<readonly string[]>
  /** Where this robot serves the same page itself, if this page is on its network; the present path first. */
  readonly near: Readable<readonly string[]>
  /** What happened when between the click and the first picture, of the newest attempt; null before one. */
  readonly timeline: Readable<Timeline | null> = this.record.view
  /** How the robot's data travels, while anybody asks; what a store itself got and sent is its `counters`. */
  readonly delivery: DeliveryWatch
  /** The second peer connection, for connectors with delivery `bulk`. */
  readonly bulkLane: Readable<BulkLaneState>
  /** The last attempt that failed, until one comes up. */
  readonly failedTimeline: Readable<Timeline | null> = this.record.failed
  /** Messages that the robot did not accept. */
  readonly refusals: { subscribe(listener: (refusal: Refusal) => void): () => void }

  constructor(
    /** The robot that it leads to. */
    readonly robotId: string,
    private readonly around: ConnectionSurroundings,
  ) {
    const { platform, socket } = around
    this.timer = new WakeTimer(() => platform.now(), (lateMs) => this.woken(lateMs))
    this.request = new ConnectionRequest(robotId, around, {
      knowsCatalogue: () => this.conversation.known.isTold,
      announced: (catalogue) => this.announced(catalogue),
      described: (robot) => this.described(robot),
      granted: (rtcConnectionId, iceServers) => this.begin(rtcConnectionId, iceServers),
      failed: (code, message) => this.handle({ type: 'broken', code, message }),
    })
    this.conversation = new RobotConversation({
      platform,
      live: { attempt: () => this.attempt, phase: () => this.session.publicPhase },
      record: this.record,
      iceServers: () => this.request.freshIceServers(),
    })
    const { conversation } = this
    this.control = conversation.control
    this.catalogue = conversation.known.value
    this.isDescribed = conversation.known.described
    this.arrivedPictures = conversation.stores.media.arrivedLabels
    this.near = conversation.nearPath.value
    this.delivery = conversation.delivery
    this.bulkLane = conversation.lane.state
    this.refusals = { subscribe: (listener) => conversation.refused.add(listener) }
    platform.onVisibilityChange(() => conversation.visibilityChanged(platform.isVisible()))
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
    return this.conversation.known.entryOf(label)
  }

  /**
   * The picture with this RTP timestamp is on the screen (`MediaStreamStore.pictureShown` says so by itself): the robot
   * is told how old it is.
   */
  pictureSeen(label: string, rtpTimestamp: number, atMs = this.around.platform.now()): void {
    this.conversation.pictureSeen(label, rtpTimestamp, atMs)
  }

  /** Called by the `StoreManager`. */
  addStore(store: MosaicStore): void {
    this.conversation.stores.add(store)
  }

  /** Called by the `StoreManager`. */
  removeStore(store: MosaicStore): void {
    this.conversation.stores.remove(store)
  }

  /** Called by the client: the short catalogue from the server. A live robot's own word counts more. */
  announced(catalogue: Catalogue): void {
    this.conversation.known.announced(catalogue, this.session.phase === 'up')
  }

  /** Called by the client: the robot's row on the server, with what people say that it has. */
  described({ connectorConfig = null, connectorConfigIsStored = true }: Pick<RobotInfo, 'connectorConfig' | 'connectorConfigIsStored'>): void {
    const config = connectorConfigIsStored ? connectorConfig : null
    if (config === this.config) return
    this.config = config
    this.conversation.known.describe(describedCatalogue(readConnectorConfig(config)))
  }

  private handle(event: PeerEvent): void {
    const { platform } = this.around
    this.record.heard(event, platform.now())
    if (event.type === 'iceConnected') void this.explainPath()
    const effects = this.session.handle(event, platform.now(), platform.random())
    // Set first, so that whoever is told below sees the new state.
    this.publish()
    for (const effect of effects) this.carryOut(effect)
    this.timer.set(this.session.wakeAtMs)
  }

  private publish(): void {
    const now = this.status.get()
    const phase = this.session.publicPhase
    const { code, message } = this.session.reason
    const roundTripMs = phase === 'connected' ? (this.attempt?.control.clocks.roundTripMs ?? null) : null
    const isSame = now.phase === phase && now.code === code && now.message === message
    if (!isSame || now.roundTripMs !== roundTripMs) this.status.set({ phase, roundTripMs, ...reasonIn({ code, message }) })
  }

  private woken(lateMs: number): void {
    const uncountedMs = this.sleep.uncountedMs(this.around.platform.now(), wallClockMs())
    if (uncountedMs > 0) this.control.slept(uncountedMs)
    // Whatever was connected is probably gone.
    if (lateMs > SLEPT_MS || uncountedMs > 0) {
      this.around.socket.doubt()
      this.doubt()
    }
    this.handle({ type: 'ticked' })
  }

  private doubt(): void {
    if (this.attempt) this.handle({ type: 'doubted', patienceMs: this.attempt.patienceMs })
  }

  private carryOut(effect: PeerEffect): void {
    const { conversation } = this
    switch (effect.type) {
      case 'request':
        this.record.begin(this.around.platform.now())
        conversation.stores.begin()
        return this.requestIfOnline()
      case 'makeOffer':
        return void this.attempt?.offer(conversation.stores.media.lines())
      case 'sendHello':
        return this.attempt?.control.sendHello(conversation.resumeWord())
      case 'sendPing':
        return this.attempt?.control.sendPing()
      case 'treatAsOriginal':
        return conversation.treatAsOriginal()
      case 'drop':
        return this.drop(effect.bye)
      case 'tellConnected':
        return conversation.stores.linkUp()
      case 'tellDisconnected':
        return this.tellDisconnected(reasonIn(effect))
      case 'tellFailed':
        return conversation.failed({ ...reasonIn(effect), code: effect.code })
    }
  }

  private tellDisconnected(why: { code?: string; message?: string }): void {
    const { conversation, session } = this
    // Closed between two attempts there was nothing to drop, but there is something to give up.
    if (session.phase === 'closed' || session.phase === 'suspended') conversation.closed()
    if (session.publicPhase !== 'reconnecting') return conversation.stores.tellDisconnected(why)
    this.around.socket.doubt()
    conversation.stores.tellInterrupted(why)
  }

  private drop(bye: boolean): void {
    const { attempt } = this
    this.request.giveUp()
    // First of all, in this very moment: a page that is put away may have no other.
    const zerosLeave = bye && this.control.leaving()
    const isPutAway = this.session.phase === 'suspended'
    if (zerosLeave && isPutAway) this.around.platform.standStill(ZEROS_LEAVE_MS)
    this.attempt = null
    this.record.end(this.session.reason.code ?? 'peer.closed', this.around.platform.now())
    this.conversation.linkLost(bye)
    attempt?.close(bye, zerosLeave && !isPutAway)
  }

  private serverChanged(): void {
    if (this.around.socket.state.get() !== 'online') return
    if (this.session.phase === 'requesting') this.requestIfOnline()
    else this.handle({ type: 'robotReady' })
  }

  // The server connects only those whose socket it has; until then the phase's time-out runs.
  private requestIfOnline(): void {
    if (this.around.socket.state.get() === 'online') void this.request.make()
  }

  private begin(rtcConnectionId: string, iceServers: readonly IceServer[]): void {
    const { platform, socket } = this.around
    const options = { rtcConnectionId, iceServers, holdCandidates: !this.conversation.known.isTold }
    const { stores, control } = this.conversation
    this.attempt = new PeerAttempt(platform, socket, options, {
      happened: (event) => this.handle(event),
      controlHeard: (message) => this.controlHeard(message),
      channelOpened: () => control.linkUp(),
      trackArrived: (label, stream, receiver) => stores.trackArrived(label, stream, receiver),
    })
    stores.setLink(this.attempt.link)
    this.handle({ type: 'granted' })
  }

  private controlHeard(message: ControlMessage | null): void {
    this.handle({ type: 'robotHeard' })
    if (message?.type === 'bye') return this.handle({ type: 'broken', ...reasonIn(message.data), code: message.data.code })
    if (message?.type === 'hello') this.handle({ type: 'helloHeard' })
    if (message) this.conversation.heard(message, this.session.isGreeted === true)
  }

  private signaled(message: SignalingMessage): void {
    if (message.type === 'status.update' && message.data.robotId === this.robotId) this.statusChanged(message.data.status)
    if (this.attempt?.signaled(message)) this.record.signaled(message, this.around.platform.now())
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
}
