import {
  RobotStatus,
  type Catalogue,
  type ControlMessage,
  type IceCandidate,
  type IceServer,
  type SdpOffer,
  type SignalingMessage,
  type TicketKey,
} from '@mosaic/protocol'
import { randomId, type Platform, type Readable } from '@mosaic/client'
import { microseconds, SignalingSocket, wallClockMs } from '@mosaic/client/parts'
import { catalogueOf } from './connectors/catalogue'
import type { DataConnector, TrackConnector } from './connectors/Connector'
import { DataOutlet } from './connectors/DataOutlet'
import { LogConnector } from './connectors/LogConnector'
import { Loudspeaker, type VoicePlayer } from './connectors/Loudspeaker'
import { TrackOutlet } from './connectors/TrackOutlet'
import type { ControlPort } from './control/ControlPort'
import { StopLatch } from './control/StopLatch'
import { RobotPeer, type Site } from './peers/RobotPeer'
import { RobotView, type PageRobotState } from './RobotView'
import { Admission, type Prepared } from './signaling/admission'
import { RobotSignaling } from './signaling/robotSignaling'
import { BadTicket, identityOf, type Identity, type Verify } from './signaling/tickets'

/** Each viewer costs this device an encoder of its own. */
const PLACES = 6
const SOFTWARE = 'mosaic-page-robot/0.1.0'

/** What a server knows a robot by. */
export interface RobotCredentials {
  robotId: string
  token: string
}

export interface PageRobotOptions {
  platform: Platform
  /** `https://mosaic.example.org`. */
  baseUrl: string
  credentials: RobotCredentials
  data: readonly DataConnector[]
  tracks: readonly TrackConnector[]
  /** Plays an operator's voice; null: this robot has no loudspeaker. */
  play: ((track: MediaStreamTrack) => VoicePlayer) | null
  verify: Verify
}

/** Represents a robot that is a page: signs in, answers operators, and shares what this device has while somebody watches. */
export class PageRobot implements Site {
  readonly platform: Platform
  readonly bootId = randomId()
  readonly software = SOFTWARE
  readonly catalogue: Catalogue
  readonly data = new Map<string, DataOutlet>()
  readonly tracks = new Map<string, TrackOutlet>()
  readonly speaker: Loudspeaker | null
  readonly log: LogConnector
  private readonly view: RobotView
  private readonly machine: RobotSignaling
  private readonly socket: SignalingSocket
  private readonly admission = new Admission(PLACES)
  private readonly peers = new Map<string, RobotPeer>()
  /** The candidates of those whose tickets are being checked. */
  private readonly arriving = new Map<string, IceCandidate[]>()
  private readonly latch = new StopLatch()
  private keys: readonly TicketKey[] = []
  private iceServers: readonly IceServer[] = []
  private isRunning = false

  readonly state: Readable<PageRobotState>

  constructor(private readonly options: PageRobotOptions) {
    const { platform, baseUrl, credentials } = options
    this.platform = platform
    this.log = new LogConnector()
    this.view = new RobotView(this.log)
    this.state = this.view.state
    this.speaker = options.play === null ? null : new Loudspeaker(platform, options.play, (id) => this.talkerChanged(id), () => this.latch.isStopped)
    for (const connector of options.tracks) this.tracks.set(connector.entry.label, this.trackOutlet(connector))
    for (const connector of [...options.data, this.log]) this.data.set(connector.entry.label, this.dataOutlet(connector))
    const speakers = this.speaker === null ? [] : [this.speaker.entry]
    const outlets = [...this.data.values()].map(({ connector }) => connector.entry)
    this.catalogue = catalogueOf([...[...this.tracks.values()].map(({ entry }) => entry), ...speakers, ...outlets])
    this.machine = new RobotSignaling(credentials.robotId, () => platform.random())
    this.socket = new SignalingSocket(`${baseUrl.replace(/^http/, 'ws')}/ws/robot`, platform, this.machine)
    this.socket.onMessage((message) => this.signaled(message))
    this.socket.onRefused((code) => this.view.show({ refusal: code, server: 'offline' }))
    this.socket.state.subscribe(() => this.serverChanged())
  }

  /** Share, from now until `stop`. */
  start(): void {
    this.isRunning = true
    this.view.show({ refusal: null })
    this.socket.start(this.options.credentials.token)
  }

  /** End everything at once: operators are told, cameras closed, the socket too. */
  stop(): void {
    if (!this.isRunning) return
    this.isRunning = false
    for (const peerId of [...this.arriving.keys()]) this.turnAway(peerId)
    for (const peer of [...this.peers.values()]) peer.close('peer.shutdown')
    this.socket.send('status.update', { status: RobotStatus.DISCONNECTED })
    this.socket.stop()
  }

  /** The page is looked at again: try what failed meanwhile. */
  wake(): void {
    if (!this.isRunning) return
    if (this.socket.state.get() === 'offline' && this.state.get().refusal === null) this.socket.start(this.options.credentials.token)
    for (const outlet of this.tracks.values()) outlet.reopen()
  }

  /** Say what is missing, on the page and in the log. */
  report(label: string, problem: string): void {
    this.view.problem(label, problem)
  }

  /** Film with another camera, or at another size; whoever watches goes on. */
  use(connector: TrackConnector): void {
    this.tracks.get(connector.entry.label)?.reopen(connector)
  }

  peerGreeted(peer: RobotPeer): void {
    this.tellPeers()
    peer.send('stop.state', this.latch.state)
    const talking = this.speaker?.talking
    if (talking != null) peer.send('media.talking', this.talkingWord(talking))
    this.log.say('info', `${nameOf(peer)} is here`)
    this.showViewers()
  }

  peerEnded(peer: RobotPeer, code: string, message: string): void {
    this.peers.delete(peer.id)
    this.admission.leave(peer.id)
    // Whoever was told by a bye forgets the connection; the server does, too.
    this.socket.send('signaling.close_peer_connection', message === '' ? { rtcConnectionId: peer.id, code } : { rtcConnectionId: peer.id, code, message })
    this.log.say('info', `${nameOf(peer)} has left (${code})`)
    this.tellStatus()
    this.tellPeers()
    this.showViewers()
  }

  watchChanged(_peer: RobotPeer): void {
    this.showViewers()
  }

  commandHeard(peer: RobotPeer, message: ControlMessage, answer: ControlPort): void {
    switch (message.type) {
      case 'stop': {
        const { ack, isNew } = this.latch.stop(message.data, peer.identity, microseconds(this.platform.now()))
        answer.send('stop.ack', ack)
        return isNew ? this.stopChanged(peer) : undefined
      }
      case 'stop.clear': {
        const code = this.latch.clear(peer.identity)
        return code === null ? this.stopChanged(peer) : void peer.send('refusal', { label: '_mosaic', code })
      }
      case 'lease.request':
        // Nothing moves: there is nothing that one alone may command.
        return void peer.send('lease.reply', { resource: message.data.resource, outcome: 'denied', epoch: 0, code: 'lease.unknown_resource' })
      default:
        return
    }
  }

  private trackOutlet(connector: TrackConnector): TrackOutlet {
    return new TrackOutlet(connector, (label, track, problem) => this.view.captureChanged(label, track, problem))
  }

  private dataOutlet(connector: DataConnector): DataOutlet {
    return new DataOutlet(connector, () => this.platform.now(), (label, problem) => this.view.problem(label, problem))
  }

  private serverChanged(): void {
    const server = this.socket.state.get()
    this.view.show({ server })
    if (server !== 'online') return
    // Before the status: whoever sees it ready may connect at once.
    if (this.machine.expectsTickets) this.socket.send('catalogue.announce', { catalogue: this.catalogue })
    this.tellStatus()
  }

  private tellStatus(): void {
    this.socket.send('status.update', { status: this.admission.isFull ? RobotStatus.RTC_CONNECTED : RobotStatus.READY_TO_CONNECT })
  }

  private signaled(message: SignalingMessage): void {
    switch (message.type) {
      case 'session.welcome':
        this.keys = message.data.keys
        this.iceServers = message.data.iceServers
        return
      case 'signaling.prepare_connection':
        return this.admission.prepare(message.data, this.platform.now())
      case 'signaling.send_sdp_offer':
        return this.offered(message.data)
      case 'signaling.exchange_ice_candidate': {
        const { rtcConnectionId: peerId, iceCandidate } = message.data
        if (!this.admission.candidate(peerId, iceCandidate)) return
        this.arriving.get(peerId)?.push(iceCandidate)
        return this.peers.get(peerId)?.addCandidate(iceCandidate)
      }
      case 'signaling.close_peer_connection':
        this.turnAway(message.data.rtcConnectionId)
        return this.peers.get(message.data.rtcConnectionId)?.close(message.data.code ?? 'peer.closed')
      default:
        return
    }
  }

  private offered(offer: SdpOffer): void {
    const decision = this.admission.decide(offer, this.iceServers, this.platform.now())
    if (decision.type === 'ignore') return
    if (decision.type === 'refuse') return this.refuse(offer, decision.code, decision.message)
    void this.take(offer, decision.prepared, decision.iceServers)
  }

  private async take(offer: SdpOffer, prepared: Prepared | null, iceServers: readonly IceServer[]): Promise<void> {
    const peerId = offer.rtcConnectionId
    const candidates = [...(prepared?.candidates ?? [])]
    this.arriving.set(peerId, candidates)
    try {
      const identity = await this.identityOf(prepared)
      // Gone meanwhile, or this robot is.
      if (!this.arriving.delete(peerId)) return
      const peer = new RobotPeer(peerId, identity, this, iceServers, {
        answer: (sdpAnswer) => this.socket.send('signaling.send_sdp_answer', { rtcConnectionId: peerId, sdpAnswer }),
        candidate: (iceCandidate) => this.socket.send('signaling.exchange_ice_candidate', { rtcConnectionId: peerId, iceCandidate }),
      })
      this.peers.set(peerId, peer)
      this.tellStatus()
      peer.begin(offer, candidates)
    } catch (error) {
      if (!(error instanceof BadTicket)) throw error
      this.turnAway(peerId)
      this.log.say('warn', `An operator was refused: ${error.message}`)
      this.refuse(offer, 'auth.bad_ticket', error.message)
    }
  }

  private turnAway(peerId: string): void {
    if (this.arriving.delete(peerId)) this.admission.leave(peerId)
  }

  private async identityOf(prepared: Prepared | null): Promise<Identity> {
    if (prepared === null) throw new BadTicket('the offer came without a ticket')
    const { credentials, verify } = this.options
    return identityOf({ robotId: credentials.robotId, prepared: prepared.word, keys: this.keys, wallS: wallClockMs() / 1000, verify })
  }

  private refuse({ rtcConnectionId }: SdpOffer, code: string, message: string): void {
    this.socket.send('signaling.close_peer_connection', { rtcConnectionId, code, message })
  }

  private stopChanged(by: RobotPeer): void {
    const { state } = this.latch
    for (const peer of this.open()) peer.send('stop.state', state)
    this.log.say('warn', state.isStopped ? `${nameOf(by)} said stop: the loudspeaker is silent` : `${nameOf(by)} cleared the stop`)
    this.view.show({ isStopped: state.isStopped })
  }

  private talkerChanged(peerId: string | null): void {
    for (const peer of this.open()) peer.send('media.talking', this.talkingWord(peerId))
  }

  private talkingWord(peerId: string | null): { label: string; peerId?: string; name: string } {
    const label = this.speaker?.entry.label ?? ''
    const name = this.peers.get(peerId ?? '')?.identity.name ?? ''
    return peerId === null ? { label, name: '' } : { label, peerId, name }
  }

  private tellPeers(): void {
    const open = this.open()
    const peers = open.map(({ info }) => info)
    for (const peer of open) peer.send('peers', { you: peer.id, peers })
  }

  private open(): RobotPeer[] {
    return [...this.peers.values()].filter(({ isOpen }) => isOpen)
  }

  private showViewers(): void {
    this.view.show({
      viewers: this.open().map(({ id, identity, watched }) => {
        return { id, name: identity.name, role: identity.role, isVerified: identity.isVerified, labels: watched }
      }),
    })
  }
}

function nameOf({ identity }: RobotPeer): string {
  return identity.name || 'Somebody'
}
