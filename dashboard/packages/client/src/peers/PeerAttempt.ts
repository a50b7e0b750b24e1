import type { ControlMessage, IceCandidate, IceServer, SignalingMessage } from '@mosaic/protocol'
import { isAbout, reasonIn } from '../words/connectionWords'
import { ControlChannel } from './ControlChannel'
import { LocalCandidates } from './LocalCandidates'
import { PeerLink, type MediaLine } from './PeerLink'
import type { PeerEvent } from './peerEvents'
import type { Platform } from '../platform/Platform'
import type { SignalingSocket } from '../signaling/SignalingSocket'
import { StopChannel } from './StopChannel'

/** How long a closing connection stays for its farewell to leave. */
const FAREWELL_MS = 200
/** Patience with a robot after a change of network; a live one answers a ping within a round trip. */
const DOUBT_MS = 700
const DOUBT_ROUND_TRIPS = 4

export interface AttemptListener {
  happened(event: PeerEvent): void
  controlHeard(message: ControlMessage | null): void
  /** The control or the stop channel can be used from now on. */
  channelOpened(): void
  trackArrived(label: string, stream: MediaStream, receiver: RTCRtpReceiver): void
}

export interface AttemptOptions {
  rtcConnectionId: string
  iceServers: readonly IceServer[]
  /** An original robot drops candidates that come before it has answered: ours wait for the answer. */
  holdCandidates: boolean
}

/** Tries to reach a robot once: a peer connection with its control channel and its identity on the signaling socket. */
export class PeerAttempt {
  readonly link: PeerLink
  readonly control: ControlChannel
  readonly stop: StopChannel
  private readonly rtcConnectionId: string
  private readonly candidates: LocalCandidates
  private isOver = false

  constructor(
    platform: Platform,
    private readonly socket: SignalingSocket,
    options: AttemptOptions,
    private readonly listener: AttemptListener,
  ) {
    this.rtcConnectionId = options.rtcConnectionId
    this.candidates = new LocalCandidates((candidate) => this.sendCandidate(candidate), { isHeld: options.holdCandidates })
    this.link = new PeerLink(platform, options.iceServers)
    this.control = new ControlChannel(this.link.control, () => platform.now(), {
      controlOpened: () => {
        this.happened({ type: 'controlOpened' })
        this.channelOpened()
      },
      controlClosed: () => this.happened({ type: 'broken', code: 'peer.lost' }),
      controlHeard: (message) => this.heard(message),
    })
    this.stop = new StopChannel(this.link.stop, () => platform.now(), {
      opened: () => this.channelOpened(),
      acknowledged: (data) => this.heard({ type: 'stop.ack', data }),
    })
    this.link.listen({
      candidateFound: (candidate) => this.candidates.found(candidate),
      iceConnected: () => this.happened({ type: 'iceConnected' }),
      iceHesitates: () => this.happened({ type: 'doubted', patienceMs: this.patienceMs }),
      linkConnected: () => this.happened({ type: 'linkConnected' }),
      linkBroken: (code) => this.happened({ type: 'broken', code }),
      trackArrived: (label, stream, receiver) => listener.trackArrived(label, stream, receiver),
    })
  }

  /** How long a robot that is there may take for a word. */
  get patienceMs(): number {
    return Math.max(DOUBT_MS, DOUBT_ROUND_TRIPS * (this.control.clocks.roundTripMs ?? 0))
  }

  async offer(lines: readonly MediaLine[]): Promise<void> {
    const { rtcConnectionId } = this
    try {
      const { sdp, tracks } = await this.link.offer(lines)
      const offer = { rtcConnectionId, sdpOffer: sdp }
      // An original server refuses keys that it does not know, so none is sent without need.
      const data = Object.keys(tracks).length > 0 ? { ...offer, tracks } : offer
      const isSent = !this.isOver && this.socket.send('signaling.send_sdp_offer', data)
      this.happened(isSent ? { type: 'offered' } : { type: 'broken', code: 'signal.unreachable' })
    } catch (error) {
      this.happened({ type: 'broken', code: 'sdp.invalid', message: String(error) })
    }
  }

  /** A message of the server; false: it is about something else. */
  signaled(message: SignalingMessage): boolean {
    if (!isAbout(message, this.rtcConnectionId)) return false
    if (message.type === 'signaling.send_sdp_answer') void this.answered(message.data.sdpAnswer)
    else if (message.type === 'signaling.exchange_ice_candidate') void this.link.addCandidate(message.data.iceCandidate)
    else if (message.type === 'signaling.close_peer_connection') {
      this.happened({ type: 'broken', code: 'peer.closed', ...reasonIn(message.data) })
    }
    return true
  }

  /**
   * Drop everything; with `bye` the robot is told on both ways that this was on purpose. `zerosLeave`: the server tells
   * it only when they have had time to arrive, because a robot that hears it listens to nothing more.
   */
  close(bye: boolean, zerosLeave = false): void {
    this.isOver = true
    if (bye) this.control.send('bye', { code: 'peer.closed' })
    if (bye && !zerosLeave) this.tellServer()
    this.control.close()
    this.stop.close()
    if (!bye) return this.link.close()
    setTimeout(() => {
      if (zerosLeave) this.tellServer()
      this.link.close()
    }, FAREWELL_MS)
  }

  private heard(message: ControlMessage | null): void {
    if (!this.isOver) this.listener.controlHeard(message)
  }

  private tellServer(): void {
    this.socket.send('signaling.close_peer_connection', { rtcConnectionId: this.rtcConnectionId })
  }

  private async answered(sdp: string): Promise<void> {
    this.happened({ type: 'answered' })
    try {
      await this.link.accept(sdp)
    } catch (error) {
      this.happened({ type: 'broken', code: 'sdp.invalid', message: String(error) })
      return
    }
    this.candidates.release()
  }

  private sendCandidate(iceCandidate: IceCandidate): void {
    const { rtcConnectionId } = this
    if (!this.isOver) this.socket.send('signaling.exchange_ice_candidate', { rtcConnectionId, iceCandidate })
  }

  private channelOpened(): void {
    if (!this.isOver) this.listener.channelOpened()
  }

  // What an attempt that is over still says concerns nobody.
  private happened(event: PeerEvent): void {
    if (!this.isOver) this.listener.happened(event)
  }
}
