import {
  CONTROL_LABEL,
  CONTROL_PROTOCOL_VERSION,
  STOP_LABEL,
  type Catalogue,
  type ControlMessage,
  type ControlMessages,
  type IceCandidate,
  type IceServer,
  type PeerInfo,
  type SdpOffer,
} from '@mosaic/protocol'
import type { Platform } from '@mosaic/client'
import { ChannelPartials, MachineDriver } from '@mosaic/client/parts'
import type { DataOutlet } from '../connectors/DataOutlet'
import type { Loudspeaker } from '../connectors/Loudspeaker'
import type { TrackOutlet, TrackWatcher } from '../connectors/TrackOutlet'
import { ControlPort } from '../control/ControlPort'
import type { PictureTimes } from '../media/pictureTimes'
import type { Identity } from '../signaling/tickets'
import { AnsweringLink, type LineUse } from './AnsweringLink'
import { OutletPorts } from './OutletPorts'
import { RobotPeerMachine, type RobotPeerEffect, type RobotPeerEvent } from './peerOfRobot'

/**
 * What this robot does beyond the basic protocol. Not among it: a second connection for bulk, as nothing is large; resuming, as
 * nothing is worth repeating. How a picture's timestamps are read it says where its browser knows them.
 */
export const ROBOT_EXTENSIONS: Readonly<Record<string, number>> = {
  catalogue: 1,
  mediaWatch: 1,
  refusals: 1,
  lease: 1,
  stop: 1,
  renegotiate: 1,
}

/** What one robot is to all its peers. */
export interface Site {
  readonly platform: Platform
  readonly bootId: string
  readonly software: string
  readonly catalogue: Catalogue
  readonly data: ReadonlyMap<string, DataOutlet>
  readonly tracks: ReadonlyMap<string, TrackOutlet>
  readonly speaker: Loudspeaker | null
  /** Null: this browser does not know the timestamps of the pictures that it sends. */
  readonly pictureTimes: PictureTimes | null
  /** A peer speaks our words: it hears how things stand, and the others of it. */
  peerGreeted(peer: RobotPeer): void
  peerEnded(peer: RobotPeer, code: string, message: string): void
  /** It watches something else than before. */
  watchChanged(peer: RobotPeer): void
  /** Stop, clearing and leases. `answer` says it where it was heard. */
  commandHeard(peer: RobotPeer, message: ControlMessage, answer: ControlPort): void
}

/** The way to the operator over the server. */
export interface PeerSignaling {
  answer(sdp: string): void
  candidate(candidate: IceCandidate): void
}

/** Holds one operator on a robot that is a page: its connection, what it watches, what it is told. `RobotPeerMachine` decides. */
export class RobotPeer {
  private readonly machine: RobotPeerMachine
  private readonly driver: MachineDriver<RobotPeerEvent, RobotPeerEffect>
  private readonly link: AnsweringLink
  private readonly partials: ChannelPartials
  private readonly ports: OutletPorts
  private readonly watchers = new Map<string, TrackWatcher>()
  private readonly endTimes: (() => void)[] = []
  private control: ControlPort | null = null
  private stop: ControlPort | null = null
  private isPerson = false
  /** One offer after the other. */
  private answering: Promise<unknown> = Promise.resolve()

  constructor(
    readonly id: string,
    readonly identity: Identity,
    private readonly site: Site,
    iceServers: readonly IceServer[],
    private readonly signaling: PeerSignaling,
  ) {
    const { platform } = site
    this.machine = new RobotPeerMachine(platform.now())
    this.driver = new MachineDriver<RobotPeerEvent, RobotPeerEffect>(this.machine, platform, { carryOut: (effect) => this.carryOut(effect) })
    this.partials = new ChannelPartials(() => platform.now())
    this.ports = new OutletPorts(site.data, () => platform.now(), this.partials, (refusal) => this.send('refusal', refusal))
    this.link = new AnsweringLink(platform, iceServers, (label, kind) => this.useOf(label, kind), {
      candidateFound: (candidate) => signaling.candidate(candidate),
      iceConnected: () => this.driver.tell({ type: 'securing' }),
      linkConnected: () => this.driver.tell({ type: 'connected' }),
      linkBroken: (code) => this.driver.tell({ type: 'broken', code }),
      channelOpened: (channel) => this.channelOpened(channel),
      lineFound: (label, kind, sender) => this.lineFound(label, kind, sender),
      voiceArrived: (_label, track, receiver) => site.speaker?.add(this, track, receiver),
    })
  }

  /** How others see it. */
  get info(): PeerInfo {
    const { account, name, role } = this.identity
    return { peerId: this.id, account, name, role, isPerson: this.isPerson, isOriginal: false }
  }

  get isOpen(): boolean {
    return this.machine.phase === 'open'
  }

  /** The labels that it watches or listens to. */
  get watched(): string[] {
    return [...this.watchers.keys(), ...this.ports.labels]
  }

  /** Answer its offer; `candidates` came before it. */
  begin({ sdpOffer, tracks = {} }: SdpOffer, candidates: readonly IceCandidate[]): void {
    // The deadline of the answer runs from now on.
    this.driver.tell({ type: 'operatorHeard' })
    for (const candidate of candidates) this.addCandidate(candidate)
    this.link.answer(sdpOffer, tracks).then(
      (sdp) => {
        this.signaling.answer(sdp)
        this.driver.tell({ type: 'answered' })
      },
      (error: unknown) => this.driver.tell({ type: 'closeWanted', code: 'sdp.invalid', message: String(error).slice(0, 200) }),
    )
  }

  addCandidate(candidate: IceCandidate): void {
    void this.link.addCandidate(candidate)
  }

  /** End it; the operator is told if it can be. */
  close(code: string, message?: string): void {
    this.driver.tell(message === undefined ? { type: 'closeWanted', code } : { type: 'closeWanted', code, message })
  }

  send<T extends keyof ControlMessages>(type: T, data: ControlMessages[T]): boolean {
    return this.control?.send(type, data) ?? false
  }

  get mayTalk(): boolean {
    return this.identity.role !== 'observer'
  }

  talkRefused(label: string, code: string): void {
    this.send('refusal', { label, code })
  }

  private useOf(label: string, kind: string): LineUse {
    if (label === this.site.speaker?.entry.label && kind === 'audio') return 'receive'
    return this.site.tracks.get(label)?.entry.kind === kind ? 'send' : null
  }

  private lineFound(label: string, kind: string, sender: RTCRtpSender): void {
    const { pictureTimes, bootId } = this.site
    if (pictureTimes === null || kind !== 'video') return
    this.endTimes.push(pictureTimes(sender, (origin) => void this.send('media.origin', { label, ...origin, bootId })))
  }

  private carryOut(effect: RobotPeerEffect): void {
    if (effect.type === 'greet') {
      this.send('catalogue', { catalogue: this.site.catalogue })
      return this.site.peerGreeted(this)
    }
    if (effect.sayBye) this.send('bye', effect.message === '' ? { code: effect.code } : { code: effect.code, message: effect.message })
    this.driver.stop()
    this.leave()
    this.site.peerEnded(this, effect.code, effect.message)
  }

  private leave(): void {
    for (const [label, watcher] of this.watchers) this.site.tracks.get(label)?.unwatch(watcher)
    this.watchers.clear()
    for (const end of this.endTimes) end()
    this.ports.close()
    this.site.speaker?.remove(this.id)
    this.link.close()
  }

  private channelOpened(channel: RTCDataChannel): void {
    if (channel.label === CONTROL_LABEL) this.control = this.wordsOn(channel, this.control, () => this.greet())
    else if (channel.label === STOP_LABEL) this.stop = this.wordsOn(channel, this.stop, () => {})
    else this.ports.opened(channel, () => this.site.watchChanged(this))
  }

  private wordsOn(channel: RTCDataChannel, before: ControlPort | null, opened: () => void): ControlPort {
    before?.close()
    const { platform } = this.site
    const port: ControlPort = new ControlPort(channel, () => platform.now(), this.partials, {
      opened,
      heard: (message) => this.heard(message, port),
    })
    return port
  }

  private greet(): void {
    const { software, bootId, pictureTimes } = this.site
    const extensions = pictureTimes === null ? ROBOT_EXTENSIONS : { ...ROBOT_EXTENSIONS, mediaOrigin: 1 }
    this.send('hello', { protocol: CONTROL_PROTOCOL_VERSION, extensions, software, bootId, isPerson: false })
  }

  private heard(message: ControlMessage | null, port: ControlPort): void {
    this.driver.tell({ type: 'operatorHeard' })
    switch (message?.type) {
      case 'hello':
        this.isPerson = message.data.isPerson && !this.identity.isProgram
        return this.driver.tell({ type: 'helloHeard' })
      case 'bye':
        return this.driver.tell({ type: 'byeHeard', ...message.data })
      case 'media.watch':
        return this.watch(message.data.label, message.data.on)
      case 'renegotiate.offer':
        return this.renegotiate(message.data)
      case undefined:
        return
      default:
        if (this.isOpen && message) this.site.commandHeard(this, message, port)
    }
  }

  private watch(label: string, on: boolean): void {
    const outlet = this.site.tracks.get(label)
    const sender = this.link.senderOf(label)
    const watcher = this.watchers.get(label)
    if (!this.isOpen || on === (watcher !== undefined)) return
    if (outlet === undefined || sender === null) {
      const code = outlet === undefined ? 'channel.unknown_label' : 'media.no_line'
      return void this.send('media.unavailable', { label, code })
    }
    if (watcher !== undefined) {
      this.watchers.delete(label)
      outlet.unwatch(watcher)
    } else {
      const mine = { sender, unavailable: (message: string) => void this.send('media.unavailable', { label, code: 'media.not_sent', message }) }
      this.watchers.set(label, mine)
      outlet.watch(mine)
    }
    this.site.watchChanged(this)
  }

  private renegotiate({ attempt, sdp, tracks }: ControlMessages['renegotiate.offer']): void {
    this.answering = this.answering.then(async () => {
      try {
        this.send('renegotiate.answer', { attempt, sdp: await this.link.answer(sdp, tracks), code: '' })
      } catch (error) {
        this.send('renegotiate.answer', { attempt, code: 'sdp.invalid', message: String(error).slice(0, 200) })
      }
    })
  }
}
