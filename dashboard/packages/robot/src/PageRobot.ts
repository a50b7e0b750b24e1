import { RobotStatus, type Catalogue, type ControlMessage, type ControlMessages, type SignalingMessage } from '@mosaic/protocol'
import { randomId, type Platform, type Readable } from '@mosaic/client'
import { microseconds, SignalingSocket } from '@mosaic/client/parts'
import { catalogueOf } from './connectors/catalogue'
import type { DataConnector, TrackConnector } from './connectors/Connector'
import { DataOutlet } from './connectors/DataOutlet'
import { LogConnector } from './connectors/LogConnector'
import { Loudspeaker, type VoicePlayer } from './connectors/Loudspeaker'
import { TrackOutlet } from './connectors/TrackOutlet'
import type { ControlPort } from './control/ControlPort'
import { StopLatch } from './control/StopLatch'
import type { PictureTimes } from './media/pictureTimes'
import { PeersHere } from './peers/PeersHere'
import { RobotPeer, type Site } from './peers/RobotPeer'
import { RobotView, type PageRobotState } from './RobotView'
import { Reception, type Introduction } from './signaling/Reception'
import { RobotSignaling } from './signaling/robotSignaling'
import type { Verify } from './signaling/tickets'

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
  /** Reads the timestamps of pictures as they are sent; null: this browser can't. */
  pictureTimes: PictureTimes | null
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
  readonly pictureTimes: PictureTimes | null
  readonly log: LogConnector
  private readonly view: RobotView
  private readonly machine: RobotSignaling
  private readonly socket: SignalingSocket
  private readonly reception: Reception
  private readonly peers = new PeersHere()
  private readonly latch = new StopLatch()
  private isRunning = false

  readonly state: Readable<PageRobotState>

  constructor(private readonly options: PageRobotOptions) {
    const { platform, baseUrl, credentials } = options
    this.platform = platform
    this.pictureTimes = options.pictureTimes
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
    this.reception = new Reception(
      {
        robotId: credentials.robotId,
        places: PLACES,
        verify: options.verify,
        now: () => platform.now(),
        taken: (arrival) => this.take(arrival),
        refused: (why) => this.log.say('warn', `An operator was refused: ${why}`),
      },
      this.socket,
    )
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
    this.reception.turnAllAway()
    this.peers.closeAll('peer.shutdown')
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
    this.peers.tellPeers()
    peer.send('stop.state', this.latch.state)
    const talking = this.speaker?.talking
    if (talking != null) peer.send('media.talking', this.talkingWord(talking))
    this.log.say('info', `${nameOf(peer)} is here`)
    this.showViewers()
  }

  peerEnded(peer: RobotPeer, code: string, message: string): void {
    this.peers.delete(peer.id)
    this.reception.left(peer.id)
    // Whoever was told by a bye forgets the connection; the server does, too.
    this.socket.send('signaling.close_peer_connection', message === '' ? { rtcConnectionId: peer.id, code } : { rtcConnectionId: peer.id, code, message })
    this.log.say('info', `${nameOf(peer)} has left (${code})`)
    this.tellStatus()
    this.peers.tellPeers()
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
    this.socket.send('status.update', { status: this.reception.isFull ? RobotStatus.RTC_CONNECTED : RobotStatus.READY_TO_CONNECT })
  }

  private signaled(message: SignalingMessage): void {
    switch (message.type) {
      case 'session.welcome':
        return this.reception.welcomed(message.data)
      case 'signaling.prepare_connection':
        return this.reception.prepare(message.data)
      case 'signaling.send_sdp_offer':
        return this.reception.offered(message.data)
      case 'signaling.exchange_ice_candidate': {
        const { rtcConnectionId: peerId, iceCandidate } = message.data
        if (this.reception.candidate(peerId, iceCandidate)) this.peers.get(peerId)?.addCandidate(iceCandidate)
        return
      }
      case 'signaling.close_peer_connection':
        this.reception.turnAway(message.data.rtcConnectionId)
        return this.peers.get(message.data.rtcConnectionId)?.close(message.data.code ?? 'peer.closed')
      default:
        return
    }
  }

  private take({ offer, identity, iceServers, candidates }: Introduction): void {
    const peerId = offer.rtcConnectionId
    const peer = new RobotPeer(peerId, identity, this, iceServers, {
      answer: (sdpAnswer) => this.socket.send('signaling.send_sdp_answer', { rtcConnectionId: peerId, sdpAnswer }),
      candidate: (iceCandidate) => this.socket.send('signaling.exchange_ice_candidate', { rtcConnectionId: peerId, iceCandidate }),
    })
    this.peers.add(peer)
    this.tellStatus()
    peer.begin(offer, candidates)
  }

  private stopChanged(by: RobotPeer): void {
    const { state } = this.latch
    this.peers.tell('stop.state', state)
    this.log.say('warn', state.isStopped ? `${nameOf(by)} said stop: the loudspeaker is silent` : `${nameOf(by)} cleared the stop`)
    this.view.show({ isStopped: state.isStopped })
  }

  private talkerChanged(peerId: string | null): void {
    this.peers.tell('media.talking', this.talkingWord(peerId))
  }

  private talkingWord(peerId: string | null): ControlMessages['media.talking'] {
    const label = this.speaker?.entry.label ?? ''
    const name = this.peers.get(peerId ?? '')?.identity.name ?? ''
    return peerId === null ? { label, name: '' } : { label, peerId, name }
  }

  private showViewers(): void {
    this.view.show({ viewers: this.peers.viewers() })
  }
}

function nameOf({ identity }: RobotPeer): string {
  return identity.name || 'Somebody'
}
