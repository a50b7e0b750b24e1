import {
  CHANNEL_PROTOCOL,
  CONTROL_LABEL,
  STOP_LABEL,
  type Delivery,
  type IceCandidate,
  type IceServer,
} from '@mosaic/protocol'
import { chosenPath, remoteAddressIn, type ChosenPath } from './chosenPath'
import { usableIceServers } from '../words/iceServers'
import type { Platform } from '../platform/Platform'
import { rejectedMids } from './rejectedMids'
import { RemoteCandidates } from './RemoteCandidates'
import { plainCandidate } from '../words/rtcWords'

/** A wanted media line: which connector, and whether it is a picture or sound. */
export interface MediaLine {
  label: string | null
  kind: 'video' | 'audio'
  /** The other way: this page's voice for a loudspeaker. */
  isTalk?: boolean
}

export interface PeerLinkListener {
  candidateFound(candidate: IceCandidate): void
  iceConnected(): void
  /** Nothing comes through at the moment; it may be back, or be lost. */
  iceHesitates(): void
  linkConnected(): void
  linkBroken(code: string): void
  trackArrived(label: string, stream: MediaStream, receiver: RTCRtpReceiver): void
}

/** Why a picture does not come: a reason code, or the robot has none of this name. */
export type MissingTrack = 'sdp.no_common_codec' | 'media.no_line' | 'not-sent'

export interface Offer {
  sdp: string
  /** Label of the wanted connector by the mid of its media line. */
  tracks: Record<string, string>
}

/**
 * Wraps one `RTCPeerConnection` of the offering side. Candidates of the robot wait for its answer; ours are plain
 * three-key objects. Only this side ever offers, once more for every line that comes later: there is no glare.
 */
export class PeerLink {
  private readonly connection: RTCPeerConnection
  private readonly labels = new Map<string, string>()
  private readonly voices = new Map<string, RTCRtpSender>()
  private readonly rejected = new Set<string>()
  private blindLines = 0
  private blindTracks = 0
  private readonly candidates: RemoteCandidates
  private isAnswered = false
  private hasPath = false
  private isSecured = false
  private isClosed = false
  readonly control: RTCDataChannel
  /** A channel of its own: a lost packet of anything else delays no stop. */
  readonly stop: RTCDataChannel

  constructor(
    private readonly platform: Platform,
    iceServers: readonly IceServer[],
  ) {
    this.connection = platform.openPeerConnection({ iceServers: usableIceServers(iceServers) })
    this.candidates = new RemoteCandidates(this.connection)
    this.control = this.connection.createDataChannel(CONTROL_LABEL, { ordered: true, protocol: CHANNEL_PROTOCOL })
    this.stop = this.openChannel(STOP_LABEL, 'latest', CHANNEL_PROTOCOL)
  }

  /** Tell this one what happens; nothing does before the offer. */
  listen(listener: PeerLinkListener): void {
    const { connection } = this
    connection.onicecandidate = ({ candidate }) => {
      const found = plainCandidate(candidate)
      if (found) listener.candidateFound(found)
    }
    connection.oniceconnectionstatechange = () => this.iceChanged(listener)
    connection.onconnectionstatechange = () => this.changed(listener)
    connection.ontrack = (event) => this.arrived(event, listener)
  }

  async offer(lines: readonly MediaLine[]): Promise<Offer> {
    const transceivers = lines.map((line) => ({
      line,
      transceiver: this.connection.addTransceiver(line.kind, { direction: line.isTalk === true ? 'sendonly' : 'recvonly' }),
    }))
    const description = await this.connection.createOffer()
    await this.connection.setLocalDescription(description)
    for (const { line, transceiver } of transceivers) {
      if (line.label === null) this.blindLines += 1
      if (transceiver.mid === null || line.label === null) continue
      this.labels.set(transceiver.mid, line.label)
      if (line.isTalk === true) this.voices.set(line.label, transceiver.sender)
    }
    const sdp = this.connection.localDescription?.sdp ?? description.sdp ?? ''
    return { sdp, tracks: Object.fromEntries(this.labels) }
  }

  async accept(sdp: string): Promise<void> {
    if (this.isAnswered || this.isClosed) return
    this.isAnswered = true
    await this.connection.setRemoteDescription({ type: 'answer', sdp })
    this.noteRejected(sdp)
    await this.candidates.answered()
  }

  /** The answer to a further offer, which added lines. */
  async acceptMore(sdp: string): Promise<void> {
    if (this.isClosed) return
    await this.connection.setRemoteDescription({ type: 'answer', sdp })
    this.noteRejected(sdp)
  }

  /**
   * Why there is no track for this label, now that the answer is here; null: it may still come. `isOriginal`: the robot
   * sends all that it has, as far as there are lines for it, and never more on this connection.
   */
  missing(label: string, isOriginal: boolean): MissingTrack | null {
    const mid = [...this.labels].find(([, one]) => one === label)?.[0]
    if (mid !== undefined) return this.rejected.has(mid) ? 'sdp.no_common_codec' : null
    if (!isOriginal) return null
    if (this.rejected.size > 0) return 'sdp.no_common_codec'
    return this.blindTracks >= this.blindLines ? 'media.no_line' : 'not-sent'
  }

  /** Whether a line was offered for this label. */
  hasLine(label: string): boolean {
    return [...this.labels.values()].includes(label)
  }

  /** A candidate of the robot. */
  addCandidate(candidate: IceCandidate): Promise<void> {
    return this.candidates.add(candidate)
  }

  /** A channel of a connector; works at any time, without negotiating again. `protocol` is empty for originals. */
  openChannel(label: string, delivery: Delivery, protocol: string): RTCDataChannel {
    const reliability = delivery === 'latest' ? { ordered: false, maxRetransmits: 0 } : { ordered: true }
    return this.connection.createDataChannel(label, protocol === '' ? reliability : { ...reliability, protocol })
  }

  /** The line for this page's voice to a loudspeaker; null where none was offered. */
  voiceOf(label: string): RTCRtpSender | null {
    return this.voices.get(label) ?? null
  }

  /** The robot's end of the path that is in use; null while unknown. */
  async remoteAddress(): Promise<string | null> {
    return this.isClosed ? null : remoteAddressIn(await this.connection.getStats())
  }

  /** Which way the connection takes; null before ICE has chosen. */
  async path(): Promise<ChosenPath | null> {
    return this.isClosed ? null : chosenPath(await this.connection.getStats())
  }

  close(): void {
    this.isClosed = true
    this.candidates.close()
    this.connection.onicecandidate = this.connection.oniceconnectionstatechange = null
    this.connection.onconnectionstatechange = this.connection.ontrack = null
    this.connection.close()
  }

  private iceChanged(listener: PeerLinkListener): void {
    const state = this.connection.iceConnectionState
    if (state === 'disconnected') listener.iceHesitates()
    if (state !== 'connected' && state !== 'completed') return
    this.hasPath = true
    listener.iceConnected()
  }

  private changed(listener: PeerLinkListener): void {
    const state = this.connection.connectionState
    if (state === 'connected') listener.linkConnected()
    if (state === 'connected') this.isSecured = true
    // ICE has a path and yet it failed: then it was DTLS.
    const code = this.hasPath && !this.isSecured && this.connection.iceConnectionState !== 'failed' ? 'dtls.failed' : 'ice.failed'
    if (state === 'failed' || state === 'closed') listener.linkBroken(code)
  }

  private noteRejected(sdp: string): void {
    for (const mid of rejectedMids(sdp)) this.rejected.add(mid)
  }

  private arrived({ track, streams, receiver, transceiver }: RTCTrackEvent, listener: PeerLinkListener): void {
    const [stream] = streams
    const asked = transceiver.mid === null ? undefined : this.labels.get(transceiver.mid)
    // Who answered without heeding our wish (an original robot) names the track by its stream.
    const label = asked ?? stream?.id
    if (asked === undefined) this.blindTracks += 1
    if (label === undefined) return
    listener.trackArrived(label, stream ?? this.platform.newMediaStream(track), receiver)
  }
}
