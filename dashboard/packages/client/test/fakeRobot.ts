/**
 * A robot that knows leases and the stop, as far as operators see it: it answers on the fake channels of the peers that
 * a test hands it. Its rules are those of the wire contract, for persons.
 */
import { CONTROL_EXTENSIONS, FrameReader, type ControlMessages, type Frame, type PeerInfo } from '@mosaic/protocol'
import type { FakeDataChannel, FakePeerConnection } from './fakes'

type Resource = string

interface Guest {
  info: PeerInfo
  sessionId: string
  peer: FakePeerConnection
  isSilenced: boolean
}

interface Grant {
  guest: Guest
  epoch: number
}

export interface FakeRobotOptions {
  resources?: readonly Resource[]
  extensions?: Record<string, number>
  expiryS?: number
  /** Of the robot's clock. */
  nowUs?: () => number
  /** Of a stop, there and back each. */
  latencyMs?: number
}

export class FakeRobot {
  readonly guests: Guest[] = []
  readonly stopsHeard: { channel: string; id: string; reason: string }[] = []
  readonly heard: { from: string; type: string; data: Record<string, unknown> }[] = []
  /** Every command frame that arrived, with the verdict of the lease. */
  readonly commands: { from: string; label: string; frame: Frame; isAccepted: boolean }[] = []
  journal: ControlMessages['journal']['entries'] = []
  isStopped = false
  /** What an acknowledgement says; null: the robot hears no stop. */
  safeUs: number | undefined | null = 0
  private readonly grants = new Map<Resource, Grant>()
  private readonly queues = new Map<Resource, { guest: Guest; reason: string }[]>()
  private epoch = 100

  constructor(private readonly options: FakeRobotOptions = {}) {
    for (const resource of options.resources ?? ['motion']) this.queues.set(resource, [])
  }

  /** An operator whose link is up: hello, peers, leases, stop. */
  greets(peer: FakePeerConnection, who: Partial<PeerInfo> & { peerId: string; sessionId?: string }): Guest {
    const { sessionId = who.peerId, ...rest } = who
    const info = { name: who.peerId, role: 'operator', isPerson: true, isOriginal: false, ...rest } as const
    const guest: Guest = { info, sessionId, peer, isSilenced: false }
    this.guests.push(guest)
    for (const label of ['_mosaic', '_stop']) this.listen(guest, peer.channel(label))
    const extensions = this.options.extensions ?? CONTROL_EXTENSIONS
    this.say(guest, 'hello', { protocol: 1, extensions, software: 'fake', bootId: 'b1', isPerson: false })
    this.tellPeers()
    for (const resource of this.queues.keys()) this.tellState(resource, guest)
    this.say(guest, 'stop.state', this.stopState)
    return guest
  }

  /** What arrives on a connector's channel. */
  watches(guest: Guest, label: string, resource: Resource = 'motion'): void {
    const reader = new FrameReader()
    guest.peer.channel(label).onsent = (data) => {
      const frame = typeof data === 'string' ? null : reader.read(data, 0)
      if (frame === null) return
      const grant = this.grants.get(resource)
      const isAccepted = grant?.guest === guest && grant.epoch === frame.epoch && !this.isStopped
      this.commands.push({ from: guest.info.peerId, label, frame, isAccepted })
    }
  }

  holder(resource: Resource = 'motion'): string | null {
    return this.grants.get(resource)?.guest.info.peerId ?? null
  }

  epochOf(resource: Resource = 'motion'): number {
    return this.grants.get(resource)?.epoch ?? 0
  }

  /** The holder fell silent. */
  expires(resource: Resource = 'motion', code = 'lease.expired'): void {
    this.end(resource, code)
  }

  /** The peer connection is gone: on purpose (`bye`) or not. */
  loses(guest: Guest, onPurpose = false): void {
    this.guests.splice(this.guests.indexOf(guest), 1)
    for (const [resource, queue] of this.queues) {
      this.queues.set(resource, queue.filter((waiting) => waiting.guest !== guest))
      if (onPurpose && this.grants.get(resource)?.guest === guest) this.end(resource, 'lease.peer_left')
    }
    this.tellPeers()
  }

  say<T extends keyof ControlMessages>(guest: Guest, type: T, data: ControlMessages[T]): void {
    if (!guest.isSilenced) guest.peer.channel('_mosaic').control(type, data)
  }

  sentBy(peerId: string, type: string): Record<string, unknown>[] {
    return this.heard.filter((one) => one.from === peerId && one.type === type).map(({ data }) => data)
  }

  private get latencyMs(): number {
    return this.options.latencyMs ?? 5
  }

  private get stopState(): ControlMessages['stop.state'] {
    return { isStopped: this.isStopped, by: this.isStopped ? 'somebody' : '', reason: '' }
  }

  private listen(guest: Guest, channel: FakeDataChannel): void {
    const reader = new FrameReader()
    const hear = (data: string | Uint8Array): void => {
      const frame = typeof data === 'string' ? null : reader.read(data, 0)
      if (frame === null || !this.guests.includes(guest)) return
      const message = JSON.parse(new TextDecoder().decode(frame.payload)) as { type: string; data: Record<string, unknown> }
      this.heard.push({ from: guest.info.peerId, ...message })
      this.answer(guest, channel, message)
    }
    channel.onsent = hear
  }

  private answer(guest: Guest, channel: FakeDataChannel, { type, data }: { type: string; data: Record<string, unknown> }): void {
    const resource = data.resource as Resource
    switch (type) {
      case 'lease.request':
        return this.requested(guest, resource, data as unknown as ControlMessages['lease.request'])
      case 'lease.release':
        return this.released(guest, resource)
      case 'lease.answer':
        return this.answered(guest, data as unknown as ControlMessages['lease.answer'])
      case 'stop':
        setTimeout(() => this.stopped(guest, channel, data as unknown as ControlMessages['stop']), this.latencyMs)
        return
      case 'stop.clear':
        return this.cleared(guest)
      case 'journal.read':
        if (guest.info.role === 'supervisor') this.say(guest, 'journal', { entries: this.journal })
        else this.say(guest, 'refusal', { label: '_mosaic', code: 'auth.forbidden' })
        return
      default:
    }
  }

  private requested(guest: Guest, resource: Resource, { reason, force }: ControlMessages['lease.request']): void {
    const queue = this.queues.get(resource)
    const deny = (code: string): void => this.say(guest, 'lease.reply', { resource, outcome: 'denied', epoch: 0, code })
    if (!queue) return deny('lease.unknown_resource')
    if (guest.info.role === 'observer') return deny('lease.forbidden')
    if (force && (guest.info.role !== 'supervisor' || reason === '')) return deny('lease.force_forbidden')
    const grant = this.grants.get(resource)
    if (!grant) return this.give(resource, guest, '')
    if (grant.guest === guest) {
      return this.say(guest, 'lease.reply', { resource, outcome: 'granted', epoch: grant.epoch, code: '' })
    }
    if (grant.guest.sessionId === guest.sessionId) return this.give(resource, guest, 'peer.replaced')
    if (force) return this.give(resource, guest, 'lease.taken_over', reason)
    if (!grant.guest.info.isPerson && guest.info.isPerson) return this.give(resource, guest, 'lease.preempted')
    if (!queue.some((waiting) => waiting.guest === guest)) queue.push({ guest, reason })
    this.say(guest, 'lease.reply', { resource, outcome: 'queued', epoch: 0, code: 'lease.queued' })
    this.tellState(resource)
  }

  private released(guest: Guest, resource: Resource): void {
    if (this.grants.get(resource)?.guest === guest) return this.end(resource, 'lease.released')
    const queue = this.queues.get(resource) ?? []
    this.queues.set(resource, queue.filter((waiting) => waiting.guest !== guest))
    this.say(guest, 'lease.reply', { resource, outcome: 'ended', epoch: 0, code: 'lease.released' })
    this.tellState(resource)
  }

  private answered(guest: Guest, { resource, peerId, grant, message }: ControlMessages['lease.answer']): void {
    const waiting = this.queues.get(resource)?.find((one) => one.guest.info.peerId === peerId)
    if (this.grants.get(resource)?.guest !== guest || !waiting) return
    if (grant) return this.give(resource, waiting.guest, 'lease.handed_over', message)
    this.queues.set(resource, (this.queues.get(resource) ?? []).filter((one) => one !== waiting))
    this.say(waiting.guest, 'lease.reply', { resource, outcome: 'denied', epoch: 0, code: 'lease.denied', message })
    this.tellState(resource)
  }

  // The order of the real robot: the old holder's end, everybody's news, the new holder's grant.
  private give(resource: Resource, guest: Guest, cause: string, message = ''): void {
    const before = this.grants.get(resource)
    this.epoch += 1
    this.grants.set(resource, { guest, epoch: this.epoch })
    this.queues.set(resource, (this.queues.get(resource) ?? []).filter((waiting) => waiting.guest !== guest))
    if (before) this.tellEnd(before.guest, resource, cause, message)
    this.tellState(resource)
    this.say(guest, 'lease.reply', { resource, outcome: 'granted', epoch: this.epoch, code: '' })
  }

  private end(resource: Resource, code: string): void {
    const before = this.grants.get(resource)
    const next = this.queues.get(resource)?.[0]
    if (!before) return
    if (next) return this.give(resource, next.guest, code)
    this.grants.delete(resource)
    this.tellEnd(before.guest, resource, code, '')
    this.tellState(resource)
  }

  private tellEnd(guest: Guest, resource: Resource, code: string, message: string): void {
    if (!this.guests.includes(guest)) return
    this.say(guest, 'lease.reply', { resource, outcome: 'ended', epoch: 0, code, ...(message ? { message } : {}) })
  }

  private stopped(guest: Guest, channel: FakeDataChannel, { id, reason }: ControlMessages['stop']): void {
    this.stopsHeard.push({ channel: channel.label, id, reason })
    if (this.safeUs === null) return
    const isNews = !this.isStopped
    this.isStopped = true
    const receivedUs = this.options.nowUs?.() ?? 0
    const safe = this.safeUs === undefined ? {} : { safeUs: receivedUs + this.safeUs }
    if (isNews) for (const one of this.guests) this.say(one, 'stop.state', { isStopped: true, by: guest.info.name, reason })
    const ack = { id, receivedUs, ...safe }
    setTimeout(() => {
      if (!guest.isSilenced && this.guests.includes(guest)) channel.control('stop.ack', ack)
    }, this.latencyMs)
  }

  private cleared(guest: Guest): void {
    const holds = [...this.grants.values()].some((grant) => grant.guest === guest)
    if (!holds && guest.info.role !== 'supervisor') {
      return this.say(guest, 'refusal', { label: '_mosaic', code: 'lease.required' })
    }
    this.isStopped = false
    for (const one of this.guests) this.say(one, 'stop.state', this.stopState)
  }

  private tellPeers(): void {
    const peers = this.guests.map(({ info }) => info)
    for (const guest of this.guests) this.say(guest, 'peers', { you: guest.info.peerId, peers })
  }

  private tellState(resource: Resource, only?: Guest): void {
    const grant = this.grants.get(resource)
    const queue = (this.queues.get(resource) ?? []).map(({ guest, reason }) => {
      const { peerId, name, isPerson } = guest.info
      return { peerId, name, reason, isPerson }
    })
    const state = {
      resource,
      epoch: grant?.epoch ?? 0,
      queue,
      expiryS: this.options.expiryS ?? 2,
      ...(grant ? { holder: grant.guest.info } : {}),
    }
    for (const guest of only ? [only] : this.guests) this.say(guest, 'lease.state', state)
  }
}
