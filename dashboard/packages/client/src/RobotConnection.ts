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
import { ConnectionRequest, type Granted } from './signaling/ConnectionRequest'
import { ConnectionTimeline, type Timeline } from './peers/ConnectionTimeline'
import { reasonIn } from './words/connectionWords'
import type { ControlDesk } from './control/ControlDesk'
import { readConnectorConfig } from './described/connectorConfig'
import { describedCatalogue } from './described/describedCatalogue'
import type { DeliveryWatch } from './delivery/DeliveryWatch'
import { LiveLink } from './peers/LiveLink'
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
import { MachineDriver } from './timing/MachineDriver'

/** How long the zeros for an original robot travel ahead of the server's word, which makes it listen to nothing more. */
const ZEROS_LEAVE_MS = 100

export interface ConnectionSurroundings {
  platform: Platform
  api: RestApi
  socket: SignalingSocket
  sessionIds: SessionIds
}

/**
 * Connects this page to one robot, once. It comes back by itself after a loss, with the same session, until
 * `disconnect`; the stores of the robot live through that. `OperatorPeerMachine` decides, this carries it out.
 */
export class RobotConnection implements StoreHost {
  private readonly machine: OperatorPeerMachine
  private readonly driver: MachineDriver<PeerEvent, PeerEffect>
  private readonly conversation: RobotConversation
  private readonly request: ConnectionRequest
  private readonly status = new Value<ConnectionState>({ phase: 'idle', roundTripMs: null })
  private readonly record = new ConnectionTimeline()
  private readonly link = new LiveLink(this.status)
  private readonly sleep = new SleepWatch()
  private robotStatus: RobotStatus | null = null
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
    const { link, record } = this
    this.request = new ConnectionRequest(robotId, around)
    this.conversation = new RobotConversation({ platform, link, record, ice: this.request })
    const { conversation } = this
    this.control = conversation.control
    this.catalogue = conversation.known.value
    this.isDescribed = conversation.known.described
    this.arrivedPictures = conversation.stores.media.arrivedLabels
    this.near = conversation.nearPath.value
    this.delivery = conversation.delivery
    this.bulkLane = conversation.bulk.state
    this.refusals = { subscribe: (listener) => conversation.refused.add(listener) }
    this.machine = new OperatorPeerMachine(() => platform.random())
    this.driver = new MachineDriver<PeerEvent, PeerEffect>(this.machine, platform, {
      // Set first, so that whoever is told next sees the new state.
      decided: () => this.publish(),
      carryOut: (effect) => this.carryOut(effect),
      woken: (lateMs) => this.woken(lateMs),
    })
    platform.onVisibilityChange(() => conversation.visibilityChanged(platform.isVisible()))
    platform.onPageHide(() => this.tell({ type: 'pageHidden' }))
    platform.onPageShow(() => this.tell({ type: 'pageShown' }))
    platform.onNetworkChange(() => this.doubt())
    socket.onMessage((message) => this.signaled(message))
    socket.state.subscribe(() => this.serverChanged())
  }

  /** Connect and stay connected until `disconnect`; repeated calls do nothing, after a failure one tries again. */
  connect(): void {
    this.tell({ type: 'connectWanted' })
  }

  /** End the connection; the robot is told. */
  disconnect(): void {
    this.tell({ type: 'disconnectWanted' })
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
    this.conversation.known.announced(catalogue, this.machine.phase === 'up')
  }

  /** Called by the client: the robot's row on the server, with what people say that it has. */
  described({ connectorConfig = null, connectorConfigIsStored = true }: Pick<RobotInfo, 'connectorConfig' | 'connectorConfigIsStored'>): void {
    const config = connectorConfigIsStored ? connectorConfig : null
    if (config === this.config) return
    this.config = config
    this.conversation.known.describe(describedCatalogue(readConnectorConfig(config)))
  }

  private tell(event: PeerEvent): void {
    this.record.heard(event, this.around.platform.now())
    if (event.type === 'iceConnected') void this.explainPath()
    this.driver.tell(event)
  }

  private publish(): void {
    const now = this.status.get()
    const phase = this.machine.publicPhase
    const { code, message } = this.machine.reason
    const roundTripMs = phase === 'connected' ? (this.link.clocks?.roundTripMs ?? null) : null
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
  }

  private doubt(): void {
    const { attempt } = this.link
    if (attempt) this.tell({ type: 'doubted', patienceMs: attempt.patienceMs })
  }

  private carryOut(effect: PeerEffect): void {
    const { conversation } = this
    switch (effect.type) {
      case 'request':
        this.record.begin(this.around.platform.now())
        conversation.stores.begin()
        return this.requestIfOnline()
      case 'makeOffer':
        return void this.link.attempt?.offer(conversation.stores.media.lines())
      case 'sendHello':
        return this.link.attempt?.control.sendHello(conversation.resumeWord())
      case 'sendPing':
        return this.link.attempt?.control.sendPing()
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
    const { conversation, machine } = this
    // Closed between two attempts there was nothing to drop, but there is something to give up.
    if (machine.phase === 'closed' || machine.phase === 'suspended') conversation.closed()
    if (machine.publicPhase !== 'reconnecting') return conversation.stores.tellDisconnected(why)
    this.around.socket.doubt()
    conversation.stores.tellInterrupted(why)
  }

  private drop(bye: boolean): void {
    const { attempt } = this.link
    this.request.giveUp()
    // First of all, in this very moment: a page that is put away may have no other.
    const zerosLeave = bye && this.control.leaving()
    const isPutAway = this.machine.phase === 'suspended'
    if (zerosLeave && isPutAway) this.around.platform.standStill(ZEROS_LEAVE_MS)
    this.link.attempt = null
    this.record.end(this.machine.reason.code ?? 'peer.closed', this.around.platform.now())
    this.conversation.linkLost(bye)
    attempt?.close(bye, zerosLeave && !isPutAway)
  }

  private serverChanged(): void {
    if (this.around.socket.state.get() !== 'online') return
    if (this.machine.phase === 'requesting') this.requestIfOnline()
    else this.tell({ type: 'robotReady' })
  }

  // The server connects only those whose socket it has; until then the phase's time-out runs.
  private requestIfOnline(): void {
    if (this.around.socket.state.get() !== 'online') return
    void this.request.make(this.conversation.known.isTold, {
      granted: (granted) => this.granted(granted),
      failed: (code, message) => this.tell({ type: 'broken', code, message }),
    })
  }

  private granted({ rtcConnectionId, iceServers, catalogue, robot }: Granted): void {
    if (catalogue) this.announced(catalogue)
    if (robot) this.described(robot)
    this.begin(rtcConnectionId, iceServers)
  }

  private begin(rtcConnectionId: string, iceServers: readonly IceServer[]): void {
    const { platform, socket } = this.around
    const options = { rtcConnectionId, iceServers, holdCandidates: !this.conversation.known.isTold }
    const { stores, control } = this.conversation
    const attempt = new PeerAttempt(platform, socket, options, {
      happened: (event) => this.tell(event),
      controlHeard: (message) => this.controlHeard(message),
      channelOpened: () => control.linkUp(),
      trackArrived: (label, stream, receiver) => stores.trackArrived(label, stream, receiver),
    })
    this.link.attempt = attempt
    stores.setLink(attempt.link)
    this.tell({ type: 'granted' })
  }

  private controlHeard(message: ControlMessage | null): void {
    this.tell({ type: 'robotHeard' })
    if (message?.type === 'bye') return this.tell({ type: 'broken', ...reasonIn(message.data), code: message.data.code })
    if (message?.type === 'hello') this.tell({ type: 'helloHeard' })
    if (message) this.conversation.heard(message, this.machine.isGreeted === true)
  }

  private signaled(message: SignalingMessage): void {
    if (message.type === 'status.update' && message.data.robotId === this.robotId) this.statusChanged(message.data.status)
    if (this.link.attempt?.signaled(message)) this.record.signaled(message, this.around.platform.now())
  }

  private async explainPath(): Promise<void> {
    // Told afterwards, for people alone: a browser that can't say it is no problem.
    const path = await this.link.attempt?.link.path().catch(() => null)
    if (path) this.record.explain('ice', pathText(path))
  }

  // Only a robot that comes online is news: an original one passes 0 after every failed attempt.
  private statusChanged(status: RobotStatus): void {
    const wasOffline = this.robotStatus === RobotStatus.DISCONNECTED || this.robotStatus === RobotStatus.WS_CONNECTED
    this.robotStatus = status
    if (wasOffline && status === RobotStatus.READY_TO_CONNECT) this.tell({ type: 'robotReady' })
  }
}
