import {
  CONTROL_LABEL,
  LEASE_KEEP_PERIOD_MS,
  STOP_LABEL,
  type CatalogueEntry,
  type ControlMessage,
  type ControlMessages,
  type JournalEntry,
  type Peers,
  type Refusal,
  type SafetyLimit,
  type StopState,
} from '@mosaic/protocol'
import type { Platform } from '../platform/Platform'
import { Listeners, type Readable } from '../platform/Readable'
import { Answers } from './Answers'
import { clearanceFor, resourceOf, type Clearance } from './clearance'
import { driveOf } from '../described/describedCatalogue'
import { DeskBoard } from './DeskBoard'
import type { LeaseEffect } from './leaseEntry'
import { LeaseTable, type LeaseEvent } from './leaseTable'
import { Rests } from './Rests'
import { stopRightNews } from './stopRightNews'
import { StopSender, type StopLink } from './StopSender'
import {
  whyOf,
  type Availability,
  type ClearReport,
  type ControlEvent,
  type LeaseView,
  type PeerView,
  type StopReport,
  type StopView,
  type Why,
} from '../words/views'

/** What the desk stands on. */
export interface DeskSurroundings {
  readonly platform: Pick<Platform, 'now' | 'ticks' | 'isVisible'>
  readonly link: ControlLink
  readonly known: { entryOf(label: string): CatalogueEntry | null }
  readonly senders: ConnectorSenders
}

/** The way to the robot, while there is one. */
export interface ControlLink extends StopLink {
  send<T extends keyof ControlMessages>(type: T, data: ControlMessages[T]): boolean
}

/** The connectors' own channels. */
export interface ConnectorSenders {
  /** False where none is open, or it took nothing. */
  sendOn(label: string, text: string): boolean
  /** Whether this page has sent anything to this connector. */
  hasSentOn(label: string): boolean
}

const MOTION = 'motion'
/** The wire takes no more of a reason or message. */
const MAX_TEXT = 200
/** What the robot gives at once. */
const MAX_JOURNAL_ENTRIES = 200

/**
 * Speaks for this page about who commands the robot, its stop, and its limits, and shows what the robot tells of them.
 * It lives as long as its `RobotConnection`; without a connection nothing is held and nothing may be sent.
 */
export class ControlDesk {
  private readonly table = new LeaseTable()
  private readonly stops: StopSender
  private readonly answers: Answers
  private readonly told = new Listeners<[ControlEvent]>()
  private readonly board = new DeskBoard()
  private endTicks: (() => void) | null = null
  /** And the robot has not told since that it may move again. */
  private hasSaidStop = false
  /** Of the drives that people described; null: the robot tells its connectors itself. */
  private endDescribed: (() => void)[] | null = null
  private readonly rests: Rests

  /** Called by this desk: whether messages may leave may have changed. */
  readonly changed = new Listeners<[]>()

  /** Whether the robot knows leases and the stop at all. */
  readonly availability: Readable<Availability> = this.board.availability
  /** Everybody who is connected to the robot. */
  readonly peers: Readable<readonly PeerView[]> = this.board.peers
  /** Who this page is to the robot; null while that is unknown. */
  readonly me: Readable<PeerView | null> = this.board.me
  /** By resource. */
  readonly leases: Readable<Readonly<Record<string, LeaseView>>> = this.board.leases
  /** Whether the robot is stopped, by whom, and how far this page's own stop has come. */
  readonly stopState: Readable<StopView> = this.board.stop
  /** By connector label, for what this page commands: how much of the speed is left, and why. */
  readonly limits: Readable<Readonly<Record<string, SafetyLimit>>> = this.board.limits
  /** Where the robot knows no stop: the connectors that `stop` sends zeros to instead. */
  readonly restable: Readable<readonly string[]>
  /** What happens once: granted, denied, lost, somebody asks, stopped, cleared, a right to stop taken or given back. */
  readonly events = { subscribe: (listener: (event: ControlEvent) => void): (() => void) => this.told.add(listener) }

  constructor(private readonly around: DeskSurroundings) {
    const { platform, link, senders } = around
    this.rests = new Rests(senders)
    this.restable = this.rests.labels
    this.stops = new StopSender(platform, link)
    this.stops.report.subscribe(() => this.board.showMyStop(this.stops.report.get()))
    this.answers = new Answers(link)
    this.table.handle({ type: 'visibilityChanged', isVisible: platform.isVisible() }, platform.now())
  }

  /** Ask to command; the answer shows in `leases` and `events`. False: not connected, or the robot knows no leases. */
  requestLease(resource = MOTION, { reason = '', force = false }: { reason?: string; force?: boolean } = {}): boolean {
    if (this.availability.get() !== 'available') return false
    this.handle({ type: 'requested', resource, reason: cut(reason), force })
    return true
  }

  /** Give it back, or wait for it no longer. */
  releaseLease(resource = MOTION): boolean {
    if (this.availability.get() !== 'available') return false
    this.handle({ type: 'released', resource })
    return true
  }

  /** As the holder: hand over to a peer who asked, or refuse. */
  answerLease(resource: string, peerId: string, grant: boolean, message = ''): boolean {
    return this.around.link.send('lease.answer', { resource, peerId, grant, message: cut(message) })
  }

  /**
   * Stop the robot; it stays stopped until `clearStop`. Sent before this returns and repeated until the robot has it,
   * over a reconnect too. A robot that knows no stop is sent the zeros of its drives, and the report says of which.
   * Never rejects. This is no certified emergency stop.
   */
  stop(reason = ''): Promise<StopReport> {
    const isUnavailable = this.availability.get() === 'unavailable'
    const zeros = this.needsZeros ? this.rests.sendAll() : null
    this.hasSaidStop = !isUnavailable
    return this.stops.say(cut(reason), isUnavailable ? zeros : null)
  }

  /** What makes a connector stand, for a robot that knows no stop; the result takes it away again. */
  addRest(label: string, zero: object): () => void {
    return this.rests.add(label, zero)
  }

  /** Let commands act again: the deliberate act of somebody who holds a lease, or of a supervisor. Never rejects. */
  clearStop(): Promise<ClearReport> {
    const isClear = this.availability.get() === 'available' && !this.stopState.get().isStopped
    // The answer to my own stop comes on a faster channel than the state of the robot: it may stand and not have said so.
    if (isClear && !this.hasSaidStop) return Promise.resolve({ isCleared: true })
    return this.answers.clear()
  }

  /**
   * As a supervisor: take from an observer the right to say stop, or give it back. Everybody is told by `peers`. False if
   * it could not be sent.
   */
  changeStopRight(peerId: string, mayStop: boolean): boolean {
    return this.around.link.send('stop.right', { peerId, mayStop })
  }

  /** A moment of the robot's clock (`StopView.sinceUs`) on this page's; null while they have not been compared. */
  toPageMs(robotUs: number): number | null {
    return this.around.link.toPageMs(robotUs)
  }

  /** What happened on the robot, newest first, for supervisors. Rejects with `MosaicError`. */
  readJournal(limit = 100, before?: number): Promise<readonly JournalEntry[]> {
    const atMost = Math.min(MAX_JOURNAL_ENTRIES, Math.max(1, Math.round(limit)))
    return this.answers.journal(before === undefined ? { limit: atMost } : { limit: atMost, before })
  }

  /** Whether a message for this connector may leave now, and under which epoch. */
  clearanceOf(entry: CatalogueEntry | null): Clearance {
    const resource = resourceOf(entry) ?? MOTION
    const epoch = this.table.epochOf(resource, this.around.platform.now())
    // The page slept: it shall not only not send, but also show it.
    if (epoch === 0 && this.table.view(resource).isMine) this.handle({ type: 'ticked' })
    const lease = this.table.view(resource)
    return clearanceFor(entry, {
      availability: this.availability.get(),
      isStopped: this.stopState.get().isStopped,
      me: this.me.get(),
      lease,
      epoch,
    })
  }

  /** Called by the connection: the robot said hello. */
  greeted(extensions: Readonly<Record<string, number>>): void {
    const isKnown = (extensions.lease ?? 0) >= 1 && (extensions.stop ?? 0) >= 1
    if (!isKnown) return this.original()
    this.board.availability.set('available')
    this.changed.tell()
  }

  /** Called by the connection: the robot is an original one. */
  original(): void {
    this.board.availability.set('unavailable')
    // What was said while nobody knew is said again in the way that this robot understands.
    if (this.stops.isSaying) this.stops.abandon('unavailable', this.rests.sendAll())
    this.changed.tell()
  }

  /** Called by the connection: what people describe of a robot that tells nothing itself; null: it tells. */
  setDescribed(entries: readonly CatalogueEntry[] | null): void {
    for (const end of this.endDescribed ?? []) end()
    this.endDescribed = entries && entries.flatMap((entry) => this.restOf(entry))
  }

  /** Called by the connection: its channels are open. */
  linkUp(): void {
    this.stops.linkUp()
  }

  /**
   * Called by the connection, whose channels are about to be closed: a robot that knows no stop would go on with the
   * last command of this page. True: zeros are on their way to it. Drives that this page left alone are none of its business.
   */
  leaving(): boolean {
    return this.needsZeros && this.rests.sendAll((label) => this.around.senders.hasSentOn(label)).sent.length > 0
  }

  /** Called by the connection: its channels are gone; `onPurpose` if this page said goodbye. */
  linkLost(onPurpose: boolean): void {
    this.board.clear()
    this.answers.linkLost()
    this.handle({ type: 'linkLost', onPurpose })
    if (onPurpose) this.stops.abandon('unconfirmed')
  }

  /** Called by the connection: it won't come back by itself. */
  gaveUp(why: Why): void {
    this.handle({ type: 'gaveUp', why })
    this.stops.abandon('unconfirmed')
  }

  /** Called by the connection. */
  visibilityChanged(isVisible: boolean): void {
    this.handle({ type: 'visibilityChanged', isVisible })
  }

  /** Called by the connection: the machine slept for this long, and `now` did not count it. */
  slept(ms: number): void {
    this.handle({ type: 'slept', ms })
  }

  /** Called by the connection: a message of the robot; those that are not about control are none of ours. */
  heard(message: ControlMessage): void {
    switch (message.type) {
      case 'peers':
        return this.peersHeard(message.data)
      case 'lease.reply':
        return this.handle({ type: 'replied', reply: message.data })
      case 'lease.state':
        return this.handle({ type: 'stateHeard', state: message.data })
      case 'stop.ack':
        return this.stops.acknowledged(message.data)
      case 'stop.state':
        return this.stopHeard(message.data)
      case 'safety.limit':
        return this.board.showLimit(message.data)
      case 'journal':
        return this.answers.journalHeard(message.data.entries)
      case 'refusal':
        return this.refused(message.data)
      default:
        return
    }
  }

  /** While a described robot has not shown that it knows a stop, it gets both. */
  private get needsZeros(): boolean {
    const availability = this.availability.get()
    return availability === 'unavailable' || (availability === 'unknown' && this.endDescribed !== null)
  }

  private restOf(entry: CatalogueEntry): (() => void)[] {
    const drive = driveOf(entry)
    return drive === null ? [] : [this.addRest(entry.label, drive.zero)]
  }

  // Of a connector's message: that is the store's business. Of a question: there is only one at a time of each.
  private refused(refusal: Refusal): void {
    if (refusal.label !== CONTROL_LABEL && refusal.label !== STOP_LABEL) return
    if (refusal.code === 'safety.stop_taken') return this.stops.abandon('unconfirmed')
    if (!this.answers.refused(refusal)) this.handle({ type: 'refused', why: whyOf(refusal) })
  }

  private peersHeard(peers: Peers): void {
    const before = this.peers.get()
    this.table.me = peers.you
    this.board.showPeers(peers)
    this.publish()
    for (const news of stopRightNews(before, this.peers.get())) this.told.tell(news)
  }

  private stopHeard(state: StopState): void {
    const was = this.stopState.get()
    this.board.showStop(state)
    // One that was on its way when my stop was said tells of the time before.
    const isLater = was.isStopped && was.mine?.phase !== 'sending'
    if (!state.isStopped && isLater) this.hasSaidStop = false
    if (!state.isStopped) this.answers.stopCleared()
    this.changed.tell()
    if (state.isStopped && !was.isStopped) this.told.tell({ type: 'stopped', by: state.by, reason: state.reason })
    if (!state.isStopped && was.isStopped) this.told.tell({ type: 'cleared' })
  }

  private handle(event: LeaseEvent): void {
    const effects = this.table.handle(event, this.around.platform.now())
    this.publish()
    for (const effect of effects) this.carryOut(effect)
    if (this.table.needsTicks) this.endTicks ??= this.around.platform.ticks.every(LEASE_KEEP_PERIOD_MS, () => this.handle({ type: 'ticked' }))
    else {
      this.endTicks?.()
      this.endTicks = null
    }
  }

  private carryOut(effect: LeaseEffect): void {
    if (effect.type === 'tell') {
      if (effect.event.type === 'lost') this.forgetLimits(effect.event.resource)
      return this.told.tell(effect.event)
    }
    const isSent = this.around.link.send(effect.message, effect.data)
    if (isSent && effect.message === 'lease.keep') this.table.kept(this.around.platform.now())
    if (effect.message === 'lease.release') this.forgetLimits(effect.data.resource)
  }

  private forgetLimits(resource: string): void {
    this.board.forgetLimits(resource, (label) => this.around.known.entryOf(label))
  }

  private publish(): void {
    this.board.showLeases(this.table.views)
    this.changed.tell()
  }
}

// Python counts code points, so do we.
function cut(text: string): string {
  return Array.from(text).slice(0, MAX_TEXT).join('')
}
