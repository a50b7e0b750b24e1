import {
  RobotStatus,
  type Catalogue,
  type CatalogueEntry,
  type ControlMessage,
  type IceCandidate,
  type IceServer,
  type MediaOrigin,
  type Refusal,
  type SignalingMessage,
} from '@mosaic/protocol'
import { ControlChannel } from './ControlChannel'
import { inboundOf, mediaStatistics, type StatisticsSample } from './mediaStatistics'
import { MosaicError } from './MosaicError'
import { PeerLink } from './PeerLink'
import { PeerSession, type PeerEffect, type PeerEvent } from './peerSession'
import type { Platform } from './Platform'
import { Listeners, Value, type Readable } from './Readable'
import type { RestApi } from './RestApi'
import type { SessionIds } from './SessionIds'
import type { SignalingSocket } from './SignalingSocket'
import { StoreBindings } from './StoreBindings'
import type { StoreHost } from './StoreManager'
import type { MediaSource } from './stores/MediaStreamStore'
import type { MosaicStore } from './stores/MosaicStore'
import type { ConnectionState } from './types'

export interface ConnectionSurroundings {
  platform: Platform
  api: RestApi
  socket: SignalingSocket
  sessionIds: SessionIds
}

/** One attempt: a peer connection with its identity on the signaling socket. */
interface Attempt {
  rtcConnectionId: string
  link: PeerLink
  control: ControlChannel
  /** Our candidates that wait: an original robot drops those that come before it has answered. */
  held: IceCandidate[] | null
}

/**
 * The one connection of this page to one robot. It comes back by itself after a loss, with the same session, until
 * `disconnect`; the stores of the robot live through that. `PeerSession` decides, this carries it out.
 */
export class RobotConnection implements StoreHost {
  private readonly session = new PeerSession()
  private readonly bindings: StoreBindings
  private readonly status = new Value<ConnectionState>({ phase: 'idle', roundTripMs: null })
  private readonly known = new Value<Catalogue | null>(null)
  private readonly refused = new Listeners<[Refusal]>()
  private attempt: Attempt | null = null
  private attemptNumber = 0
  private timer: ReturnType<typeof setTimeout> | null = null

  readonly state: Readable<ConnectionState> = this.status
  /** Short form from the server, full (with message schemas) once connected. */
  readonly catalogue: Readable<Catalogue | null> = this.known
  /** Messages that the robot did not accept. */
  readonly refusals = { subscribe: (listener: (refusal: Refusal) => void): (() => void) => this.refused.add(listener) }

  constructor(
    readonly robotId: string,
    private readonly around: ConnectionSurroundings,
  ) {
    const { platform } = around
    this.bindings = new StoreBindings(
      {
        now: () => platform.now(),
        ageMs: (stampUs, atMs) => this.attempt?.control.clocks.ageMs(stampUs, atMs) ?? null,
        watch: (label, on) => this.attempt?.control.send('media.watch', { label, on }) ?? false,
        mediaSource: (receiver) => this.mediaSource(receiver),
      },
      platform.isVisible(),
    )
    platform.onVisibilityChange(() => this.bindings.setVisible(platform.isVisible()))
    platform.onPageHide(() => this.handle({ type: 'pageHidden' }))
    platform.onPageShow(() => this.handle({ type: 'pageShown' }))
    around.socket.onMessage((message) => this.signaled(message))
    around.socket.state.subscribe(() => {
      if (around.socket.state.get() === 'online') this.handle({ type: 'robotReady' })
    })
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
    return this.known.get()?.entries.find((entry) => entry.label === label) ?? null
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
    const isLive = this.session.phase === 'up' && this.session.isGreeted === true
    if (!isLive && this.known.get()?.hash !== catalogue.hash) this.learn(catalogue)
  }

  private learn(catalogue: Catalogue): void {
    this.known.set(catalogue)
    this.bindings.setCatalogue(catalogue)
  }

  private handle(event: PeerEvent): void {
    const { platform } = this.around
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
    if (isSame && now.roundTripMs === roundTripMs) return
    this.status.set({ phase, ...(code === undefined ? {} : { code }), ...(message === undefined ? {} : { message }), roundTripMs })
  }

  private schedule(): void {
    if (this.timer !== null) clearTimeout(this.timer)
    const atMs = this.session.wakeAtMs
    const tick = (): void => this.handle({ type: 'ticked' })
    this.timer = atMs === null ? null : setTimeout(tick, Math.max(0, atMs - this.around.platform.now()))
  }

  private carryOut(effect: PeerEffect): void {
    switch (effect.type) {
      case 'request':
        this.bindings.begin()
        return void this.request()
      case 'makeOffer':
        return void this.offer()
      case 'sendHello':
        return this.attempt?.control.sendHello()
      case 'sendPing':
        return this.attempt?.control.sendPing()
      case 'treatAsOriginal':
        return this.bindings.treatAsOriginal()
      case 'drop':
        return this.drop(effect.bye)
      case 'tellConnected':
        return
      case 'tellDisconnected':
        return this.bindings.tellDisconnected(reasonIn(effect))
      case 'tellFailed':
        return this.bindings.tellFailed({ ...reasonIn(effect), code: effect.code })
    }
  }

  private async request(): Promise<void> {
    const number = ++this.attemptNumber
    const { api, sessionIds } = this.around
    try {
      const [grant, iceServers, catalogue] = await Promise.all([
        api.createConnection(this.robotId, sessionIds.of(this.robotId)),
        api.iceServers().catch((): IceServer[] => []),
        // Toward an original server there is none to be had.
        this.known.get() === null ? api.catalogue(this.robotId).catch(() => null) : null,
      ])
      if (number !== this.attemptNumber || this.session.phase !== 'requesting') return
      if (grant.sessionId !== undefined) sessionIds.remember(this.robotId, grant.sessionId)
      if (catalogue) this.announced(catalogue)
      this.begin(grant.rtcSessionId, iceServers)
    } catch (error) {
      if (number === this.attemptNumber) this.broken(error)
    }
  }

  private begin(rtcConnectionId: string, iceServers: readonly IceServer[]): void {
    const isOurs = this.known.get() !== null
    const link = new PeerLink(this.around.platform, iceServers, {
      candidateFound: (candidate) => this.candidateFound(rtcConnectionId, candidate),
      iceConnected: () => this.handle({ type: 'iceConnected' }),
      linkConnected: () => this.handle({ type: 'linkConnected' }),
      linkBroken: (code) => this.handle({ type: 'broken', code }),
      trackArrived: (label, stream, receiver) => this.bindings.trackArrived(label, stream, receiver),
    })
    const control = new ControlChannel(link.control, () => this.around.platform.now(), {
      controlOpened: () => this.handle({ type: 'controlOpened' }),
      controlClosed: () => this.handle({ type: 'broken', code: 'peer.lost' }),
      controlHeard: (message) => this.controlHeard(message),
    })
    this.attempt = { rtcConnectionId, link, control, held: isOurs ? null : [] }
    this.bindings.setLink(link)
    this.handle({ type: 'granted' })
  }

  private async offer(): Promise<void> {
    const { attempt } = this
    if (!attempt) return
    try {
      const { rtcConnectionId } = attempt
      const { sdp, tracks } = await attempt.link.offer(this.bindings.mediaLines())
      if (attempt !== this.attempt) return
      const offer = { rtcConnectionId, sdpOffer: sdp }
      // An original server refuses keys that it does not know.
      const isSent = this.around.socket.send(
        'signaling.send_sdp_offer',
        Object.keys(tracks).length > 0 ? { ...offer, tracks } : offer,
      )
      this.handle(isSent ? { type: 'offered' } : { type: 'broken', code: 'signal.unreachable' })
    } catch (error) {
      if (attempt === this.attempt) this.broken(error)
    }
  }

  private candidateFound(rtcConnectionId: string, iceCandidate: IceCandidate): void {
    if (this.attempt?.held) this.attempt.held.push(iceCandidate)
    else this.around.socket.send('signaling.exchange_ice_candidate', { rtcConnectionId, iceCandidate })
  }

  private signaled(message: SignalingMessage): void {
    switch (message.type) {
      case 'status.update':
        if (message.data.robotId === this.robotId && message.data.status === RobotStatus.READY_TO_CONNECT) {
          this.handle({ type: 'robotReady' })
        }
        return
      case 'signaling.send_sdp_answer':
        if (this.isOurs(message.data)) void this.answered(message.data.sdpAnswer)
        return
      case 'signaling.exchange_ice_candidate':
        if (this.isOurs(message.data)) void this.attempt?.link.addCandidate(message.data.iceCandidate)
        return
      case 'signaling.close_peer_connection':
        if (this.isOurs(message.data)) this.handle({ type: 'broken', code: 'peer.closed', ...reasonIn(message.data) })
        return
      default:
        return
    }
  }

  private isOurs({ rtcConnectionId }: { rtcConnectionId: string }): boolean {
    return this.attempt?.rtcConnectionId === rtcConnectionId
  }

  private async answered(sdp: string): Promise<void> {
    const { attempt } = this
    if (!attempt) return
    try {
      this.handle({ type: 'answered' })
      await attempt.link.accept(sdp)
      if (attempt !== this.attempt) return
      const held = attempt.held ?? []
      attempt.held = null
      for (const candidate of held) this.candidateFound(attempt.rtcConnectionId, candidate)
    } catch {
      if (attempt === this.attempt) this.handle({ type: 'broken', code: 'sdp.invalid' })
    }
  }

  private controlHeard(message: ControlMessage | null): void {
    this.handle({ type: 'robotHeard' })
    switch (message?.type) {
      case 'hello':
        this.handle({ type: 'helloHeard' })
        return this.bindings.greeted()
      case 'catalogue':
        return this.learn(message.data.catalogue)
      case 'pong':
        return this.publish()
      case 'bye':
        return this.handle({ type: 'broken', ...reasonIn(message.data), code: message.data.code })
      case 'media.origin':
        return this.bindings.originKnown(message.data)
      case 'media.unavailable':
        return this.bindings.mediaUnavailable(message.data)
      case 'refusal':
        this.bindings.refused(message.data)
        return this.refused.tell(message.data)
      default:
        return
    }
  }

  private drop(bye: boolean): void {
    const { attempt } = this
    this.attemptNumber += 1
    this.attempt = null
    if (!attempt) return
    const { rtcConnectionId } = attempt
    if (bye) {
      attempt.control.send('bye', { code: 'peer.closed' })
      this.around.socket.send('signaling.close_peer_connection', { rtcConnectionId })
    }
    this.bindings.dropLink()
    attempt.control.close()
    attempt.link.close()
  }

  private broken(error: unknown): void {
    if (error instanceof MosaicError) this.handle({ type: 'broken', code: error.code, message: error.message })
    else this.handle({ type: 'broken', code: 'sdp.invalid', message: String(error) })
  }

  private mediaSource(receiver: RTCRtpReceiver): MediaSource {
    let previous: StatisticsSample | null = null
    return {
      statistics: async () => {
        const sample = inboundOf((await receiver.getStats()) as ReadonlyMap<string, unknown>)
        if (sample === null) return null
        const statistics = mediaStatistics(sample, previous)
        previous = sample
        return statistics
      },
      pictureAgeMs: (rtpTimestamp: number, atMs: number, origin: MediaOrigin) =>
        this.attempt?.control.pictureAgeMs(rtpTimestamp, atMs, origin) ?? null,
    }
  }
}

function reasonIn({ code, message }: { code?: string; message?: string }): { code?: string; message?: string } {
  return { ...(code === undefined ? {} : { code }), ...(message === undefined ? {} : { message }) }
}
