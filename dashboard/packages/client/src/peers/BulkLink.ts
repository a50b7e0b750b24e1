import { CHANNEL_PROTOCOL, controlText, LANE_LABEL, type Delivery, type IceCandidate, type IceServer } from '@mosaic/protocol'
import { DataPort } from '../delivery/DataPort'
import { microseconds } from '../timing/clock'
import { usableIceServers } from '../words/iceServers'
import { RemoteCandidates } from './RemoteCandidates'
import { plainCandidate } from '../words/rtcWords'
import type { Platform } from '../platform/Platform'

export interface BulkLinkListener {
  candidateFound(candidate: IceCandidate): void
  opened(): void
  heard(): void
  broken(code: string): void
}

/** Tries the second peer connection once: data channels only, the first of which tells that it is up, and alive. */
export class BulkLink {
  private readonly connection: RTCPeerConnection
  private readonly port: DataPort
  private readonly candidates: RemoteCandidates
  private isClosed = false

  constructor(
    private readonly platform: Platform,
    iceServers: readonly IceServer[],
    private readonly listener: BulkLinkListener,
  ) {
    this.connection = platform.openPeerConnection({ iceServers: usableIceServers(iceServers) })
    this.candidates = new RemoteCandidates(this.connection)
    const channel = this.connection.createDataChannel(LANE_LABEL, { ordered: true, protocol: CHANNEL_PROTOCOL })
    this.port = new DataPort(
      channel,
      { dataType: 'json-bi', delivery: 'reliable', now: () => platform.now() },
      {
        opened: () => this.listener.opened(),
        closed: () => this.listener.broken('peer.lost'),
        received: () => this.listener.heard(),
        misread: () => this.listener.heard(),
      },
    )
    this.connection.onicecandidate = ({ candidate }) => {
      const found = plainCandidate(candidate)
      if (found) this.listener.candidateFound(found)
    }
    this.connection.onconnectionstatechange = () => {
      const state = this.connection.connectionState
      if (state === 'failed' || state === 'closed') this.listener.broken('ice.failed')
    }
  }

  async offer(): Promise<string> {
    const description = await this.connection.createOffer()
    await this.connection.setLocalDescription(description)
    return this.connection.localDescription?.sdp ?? description.sdp ?? ''
  }

  async accept(sdp: string): Promise<void> {
    if (this.isClosed || this.connection.remoteDescription !== null) return
    await this.connection.setRemoteDescription({ type: 'answer', sdp })
    await this.candidates.answered()
  }

  addCandidate(candidate: IceCandidate): Promise<void> {
    return this.candidates.add(candidate)
  }

  openChannel(label: string, _delivery: Delivery, protocol: string): RTCDataChannel {
    return this.connection.createDataChannel(label, { ordered: true, protocol })
  }

  ping(): void {
    this.port.send(controlText('ping', { t0: microseconds(this.platform.now()) }))
  }

  close(): void {
    this.isClosed = true
    this.candidates.close()
    this.port.close()
    this.connection.onicecandidate = this.connection.onconnectionstatechange = null
    this.connection.close()
  }
}
