import type { IceCandidate, IceServer } from '@mosaic/protocol'
import type { Platform } from '@mosaic/client'
import { plainCandidate, RemoteCandidates, usableIceServers } from '@mosaic/client/parts'

/** What a media line of an operator's offer is for: this robot's picture or sound, the operator's voice, or nothing. */
export type LineUse = 'send' | 'receive' | null

export interface AnsweringListener {
  candidateFound(candidate: IceCandidate): void
  iceConnected(): void
  linkConnected(): void
  linkBroken(code: string): void
  channelOpened(channel: RTCDataChannel): void
  /** A picture or sound of this robot has a line. */
  lineFound(label: string, kind: string, sender: RTCRtpSender): void
  /** The line for the operator's voice to a loudspeaker. */
  voiceArrived(label: string, track: MediaStreamTrack, receiver: RTCRtpReceiver): void
}

/** Wraps one `RTCPeerConnection` of the answering side: binds the media lines that it is offered, by their labels. */
export class AnsweringLink {
  private readonly connection: RTCPeerConnection
  private readonly candidates: RemoteCandidates
  private readonly senders = new Map<string, RTCRtpSender>()
  private readonly labels = new Map<string, string>()
  private hasPath = false
  private isSecured = false

  constructor(
    platform: Platform,
    iceServers: readonly IceServer[],
    private readonly useOf: (label: string, kind: string) => LineUse,
    private readonly listener: AnsweringListener,
  ) {
    const connection = platform.openPeerConnection({ iceServers: usableIceServers(iceServers) })
    this.connection = connection
    this.candidates = new RemoteCandidates(connection)
    connection.onicecandidate = ({ candidate }) => {
      const found = plainCandidate(candidate)
      if (found) listener.candidateFound(found)
    }
    connection.oniceconnectionstatechange = () => this.iceChanged()
    connection.onconnectionstatechange = () => this.changed()
    connection.ondatachannel = ({ channel }) => listener.channelOpened(channel)
    connection.ontrack = ({ track, receiver, transceiver }) => {
      const label = this.labels.get(transceiver.mid ?? '')
      if (label !== undefined) listener.voiceArrived(label, track, receiver)
    }
  }

  /** Answer an offer, the first or a further one; `tracks`: the label of each media line by its mid. */
  async answer(sdp: string, tracks: Readonly<Record<string, string>>): Promise<string> {
    const { connection } = this
    for (const [mid, label] of Object.entries(tracks)) this.labels.set(mid, label)
    await connection.setRemoteDescription({ type: 'offer', sdp })
    for (const transceiver of connection.getTransceivers()) this.bind(transceiver)
    const answer = await connection.createAnswer()
    await connection.setLocalDescription(answer)
    await this.candidates.answered()
    return connection.localDescription?.sdp ?? answer.sdp ?? ''
  }

  /** Where the picture or sound of this label goes out; null: the operator offered no line for it. */
  senderOf(label: string): RTCRtpSender | null {
    return this.senders.get(label) ?? null
  }

  /** A candidate of the operator. */
  addCandidate(candidate: IceCandidate): Promise<void> {
    return this.candidates.add(candidate)
  }

  close(): void {
    const { connection } = this
    this.candidates.close()
    connection.onicecandidate = connection.oniceconnectionstatechange = connection.onconnectionstatechange = null
    connection.ondatachannel = connection.ontrack = null
    connection.close()
  }

  private bind(transceiver: RTCRtpTransceiver): void {
    const label = this.labels.get(transceiver.mid ?? '')
    const { kind } = transceiver.receiver.track
    const use = label === undefined ? null : this.useOf(label, kind)
    transceiver.direction = use === 'send' ? 'sendonly' : use === 'receive' ? 'recvonly' : 'inactive'
    if (use !== 'send' || label === undefined || this.senders.get(label) === transceiver.sender) return
    this.senders.set(label, transceiver.sender)
    this.listener.lineFound(label, kind, transceiver.sender)
  }

  private iceChanged(): void {
    const state = this.connection.iceConnectionState
    if (state !== 'connected' && state !== 'completed') return
    this.hasPath = true
    this.listener.iceConnected()
  }

  private changed(): void {
    const state = this.connection.connectionState
    if (state === 'connected') {
      this.isSecured = true
      this.listener.linkConnected()
    }
    // ICE has a path and yet it failed: then it was DTLS.
    const isDtls = this.hasPath && !this.isSecured && this.connection.iceConnectionState !== 'failed'
    if (state === 'failed' || state === 'closed') this.listener.linkBroken(isDtls ? 'dtls.failed' : 'ice.failed')
  }
}
