/** Stand-ins for what a robot's page meets: an offering operator, a camera, who listens. */
import { CONTROL_LABEL, CHANNEL_PROTOCOL } from '@mosaic/protocol'
import { FakeDataChannel, FakePeerConnection, FakePlatform } from '../../client/test/fakes'
import type { TrackConnector } from '../src/connectors/Connector'
import { mediaEntry } from '../src/connectors/catalogue'
import type { Identity } from '../src/signaling/tickets'

export class FakeTrack {
  onended: (() => void) | null = null
  onmute: (() => void) | null = null
  onunmute: (() => void) | null = null
  muted = false
  readyState = 'live'
  isStopped = false
  contentHint = ''
  stop(): void {
    this.isStopped = true
  }
}

/** A camera that opens when the test says so. */
export class FakeCamera implements TrackConnector {
  readonly entry = mediaEntry('camera', 'video')
  readonly tracks: FakeTrack[] = []
  private readonly waiting: { open: () => void; fail: (why: string) => void }[] = []

  open(): Promise<MediaStreamTrack> {
    return new Promise((resolve, reject) => {
      const open = (): void => {
        const track = new FakeTrack()
        this.tracks.push(track)
        resolve(track as unknown as MediaStreamTrack)
      }
      this.waiting.push({ open, fail: (why) => reject(new Error(why)) })
    })
  }

  get isAsked(): boolean {
    return this.waiting.length > 0
  }

  async opens(): Promise<FakeTrack> {
    this.waiting.shift()?.open()
    await settled()
    const track = this.tracks.at(-1)
    if (track === undefined) throw new Error('nobody asked for it')
    return track
  }

  async fails(why: string): Promise<void> {
    this.waiting.shift()?.fail(why)
    await settled()
  }
}

/** The operator's lines, as its offer brings them. */
export class FakeAnsweringPeer extends FakePeerConnection {
  ondatachannel: ((event: { channel: FakeDataChannel }) => void) | null = null
  readonly lines: { mid: string; direction: string; receiver: { track: { kind: string } }; sender: { track: unknown; replaceTrack: (track: unknown) => Promise<void> } }[] = []

  getTransceivers(): unknown[] {
    return this.lines
  }

  createAnswer(): Promise<{ type: string; sdp: string }> {
    return Promise.resolve({ type: 'answer', sdp: 'answer-sdp' })
  }

  offers(kind: string): this {
    const sender = {
      track: null as unknown,
      replaceTrack: (track: unknown): Promise<void> => {
        sender.track = track
        return Promise.resolve()
      },
    }
    this.lines.push({ mid: String(this.lines.length), direction: 'recvonly', receiver: { track: { kind } }, sender })
    return this
  }

  /** The operator opens a channel. */
  opensChannel(label: string, protocol = CHANNEL_PROTOCOL): FakeDataChannel {
    const channel = new FakeDataChannel(label, { protocol })
    this.channels.push(channel)
    this.ondatachannel?.({ channel })
    return channel.opens()
  }

  connects(): FakeDataChannel {
    this.iceConnectionState = 'connected'
    this.oniceconnectionstatechange?.()
    this.connectionState = 'connected'
    this.onconnectionstatechange?.()
    return this.opensChannel(CONTROL_LABEL)
  }
}

/** A browser whose peer connections answer offers of so many lines. */
export class RobotPlatform extends FakePlatform {
  offered: readonly string[] = ['video']

  override openPeerConnection = (configuration: RTCConfiguration): RTCPeerConnection => {
    const peer = new FakeAnsweringPeer(configuration)
    for (const kind of this.offered) peer.offers(kind)
    this.peers.push(peer)
    return peer as unknown as RTCPeerConnection
  }

  get answering(): FakeAnsweringPeer {
    return this.peer as FakeAnsweringPeer
  }
}

export const ADA: Identity = { account: 'ada', name: 'Ada', role: 'operator', isProgram: false, isVerified: true }

/** What was begun has gone as far as it goes by itself. */
export async function settled(): Promise<void> {
  for (let turn = 0; turn < 20; turn += 1) await Promise.resolve()
}
