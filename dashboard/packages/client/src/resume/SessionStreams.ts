import { HELLO_TIMEOUT_MS, type Delivered, type Resume } from '@mosaic/protocol'
import { Listeners } from '../platform/Readable'
import { DeadlineTimer } from '../timing/DeadlineTimer'
import { OutgoingStream } from './OutgoingStream'
import { ResumeReceiver } from './ResumeReceiver'

/** What has arrived is told this late at the latest: the robot keeps it so long. */
const TELL_PERIOD_MS = 250
/** A word that is missed this late may be waiting unread: the page stood still. */
const STALL_MS = 500
/** Messages after which it is told at once, so that a fast robot need not forget what it keeps. */
const TELL_AFTER = 128
/** Messages that overtook the robot's word; far more than a round trip of anything. */
const MAX_HELD = 4096

/** The way to the robot, while there is one. */
export interface StreamsLink {
  /** Say how far the channels of the robot are. */
  send(type: 'delivered', delivered: Delivered): void
}

interface Held {
  label: string
  seq: number
  deliver: () => void
}

/**
 * Keeps this page's reliable channels to one robot, which outlive its connections: numbered on, repeated where the robot
 * lacks something, and never used before both sides have said how far they are.
 */
export class SessionStreams {
  private phase: 'unknown' | 'expecting' | 'resumed' | 'plain' | 'away' = 'unknown'
  private robotBootId = ''
  private readonly outgoingStreams = new Map<string, OutgoingStream>()
  private readonly receivers = new Map<string, ResumeReceiver>()
  private numbered: ReadonlySet<string> = new Set()
  private held: Held[] = []
  private untold = 0
  private timer: ReturnType<typeof setTimeout> | null = null
  private readonly patience: DeadlineTimer

  /** `lost` messages of the channel will never come, or (`sent`) never arrived; null: nobody knows how many. */
  readonly missed = new Listeners<[label: string, lost: number | null, sent: boolean]>()

  constructor(
    private readonly clock: { now(): number },
    private readonly link: StreamsLink,
  ) {
    this.patience = new DeadlineTimer(clock, (lateMs) => this.wordMissing(lateMs))
  }

  /** What to say right after hello. */
  word(): Resume {
    const received: Record<string, number> = {}
    for (const [label, receiver] of this.receivers) if (receiver.received !== null) received[label] = receiver.received
    const upcoming: Record<string, number> = {}
    for (const [label, stream] of this.outgoingStreams) if (stream.isNumbered) upcoming[label] = stream.upcoming
    return { bootId: this.robotBootId, isNew: false, received, upcoming }
  }

  /** The robot's hello. */
  greeted(extensions: Record<string, number>): void {
    if (this.phase !== 'unknown' && this.phase !== 'away') return
    this.phase = 'expecting'
    if (extensions['resume'] === undefined) this.plain()
    else this.awaitWord()
  }

  /** The robot's numbers begin anew with every connection: an original one, or an older one of ours. */
  plain(): void {
    if (this.phase !== 'resumed' && this.phase !== 'plain') this.settle('plain', nothing())
  }

  resumed(word: Resume): void {
    if (this.phase !== 'expecting') return
    this.robotBootId = word.bootId
    this.settle('resumed', word)
  }

  delivered({ seqs }: Delivered): void {
    for (const [label, seq] of Object.entries(seqs)) this.outgoingStreams.get(label)?.delivered(seq)
  }

  /** The connection is gone and will be made anew. */
  lost(): void {
    this.endTimers()
    this.phase = 'away'
    this.held = []
    for (const stream of this.outgoingStreams.values()) stream.lost()
  }

  /** It has ended on purpose: what comes next begins anew. */
  close(): void {
    this.endTimers()
    this.phase = 'unknown'
    this.held = []
    for (const [label, stream] of this.outgoingStreams) this.report(label, stream.close(), true)
    this.outgoingStreams.clear()
    this.receivers.clear()
    this.robotBootId = ''
  }

  /** A message of a reliable channel: handed on once, in order, as soon as it is known whether it is new. */
  arrived(label: string, seq: number, deliver: () => void): void {
    if (this.phase !== 'resumed' && this.phase !== 'plain') {
      if (this.held.length < MAX_HELD) this.held.push({ label, seq, deliver })
      return
    }
    const receiver = this.numbered.has(label) ? this.receivers.get(label) : undefined
    if (receiver === undefined) return deliver()
    const { isNew, lost } = receiver.arrived(seq)
    this.tellSoon()
    this.report(label, lost, false)
    if (isNew) deliver()
  }

  /** What a store sends there. `waits`: it is kept while there is no connection. */
  outgoing(label: string, waits: boolean): OutgoingStream {
    const existing = this.outgoingStreams.get(label)
    if (existing) return existing
    const stream = new OutgoingStream(() => this.clock.now(), waits)
    this.outgoingStreams.set(label, stream)
    if (this.phase === 'plain') stream.plain()
    else if (this.phase === 'resumed') stream.resumed(0)
    return stream
  }

  /** The store of this channel is gone; the next one misses nothing of before. */
  released(label: string): void {
    this.receivers.get(label)?.renewed()
    this.outgoingStreams.get(label)?.released()
  }

  private settle(phase: 'resumed' | 'plain', word: Resume): void {
    this.endTimers()
    this.phase = phase
    this.numbered = new Set(Object.keys(word.upcoming))
    for (const [label, upcoming] of Object.entries(word.upcoming)) this.announced(label, upcoming, word.isNew)
    for (const [label, stream] of this.outgoingStreams) {
      const received = word.received[label]
      const lost = received === undefined ? stream.plain() : stream.resumed(word.isNew ? null : received)
      this.report(label, lost, true)
    }
    const { held } = this
    this.held = []
    for (const { label, seq, deliver } of held) this.arrived(label, seq, deliver)
  }

  private announced(label: string, upcoming: number, isNew: boolean): void {
    let receiver = this.receivers.get(label)
    if (receiver === undefined || isNew) {
      if (receiver !== undefined) this.report(label, receiver.announced(null), false)
      receiver = new ResumeReceiver(null)
      this.receivers.set(label, receiver)
    }
    this.report(label, receiver.announced(upcoming), false)
  }

  private awaitWord(): void {
    this.patience.set(this.clock.now() + HELLO_TIMEOUT_MS)
  }

  private wordMissing(lateMs: number): void {
    if (lateMs > STALL_MS) this.awaitWord()
    else this.plain()
  }

  private report(label: string, lost: number | null, sent: boolean): void {
    if (lost !== 0) this.missed.tell(label, lost, sent)
  }

  private tellSoon(): void {
    this.untold += 1
    if (this.untold >= TELL_AFTER) this.tellDelivered()
    else this.timer ??= setTimeout(() => this.tellDelivered(), TELL_PERIOD_MS)
  }

  private tellDelivered(): void {
    this.stopTelling()
    const seqs: Record<string, number> = {}
    for (const [label, receiver] of this.receivers) {
      const seq = receiver.untold()
      if (seq !== null) seqs[label] = seq
    }
    if (Object.keys(seqs).length > 0) this.link.send('delivered', { seqs })
  }

  private stopTelling(): void {
    this.untold = 0
    if (this.timer !== null) clearTimeout(this.timer)
    this.timer = null
  }

  private endTimers(): void {
    this.stopTelling()
    this.patience.set(null)
  }
}

function nothing(): Resume {
  return { bootId: '', isNew: true, received: {}, upcoming: {} }
}
