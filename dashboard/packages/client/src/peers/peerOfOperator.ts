/**
 * Decides the life of one robot's connection, purely: events in, effects out, the time is an argument.
 * Every phase has a time-out with a reason code; a lost connection comes back by itself until `disconnect`.
 */
import { HELLO_TIMEOUT_MS, PEER_LOST_AFTER_MS, PING_PERIOD_MS } from '@mosaic/protocol'
import { backoffDelayMs } from '../timing/backoff'
import type { PeerEffect, PeerEvent, PeerPhase } from './peerEvents'
import type { ConnectionPhase } from '../words/types'

/** Each phase's patience and the reason code when it is over. Signaling takes a round trip, ICE the longest. */
const TIMEOUTS: Partial<Record<PeerPhase, { afterMs: number; code: string }>> = {
  requesting: { afterMs: 8_000, code: 'signal.unreachable' },
  offering: { afterMs: 5_000, code: 'sdp.timeout' },
  answering: { afterMs: 10_000, code: 'signal.no_answer' },
  linking: { afterMs: 15_000, code: 'ice.timeout' },
  opening: { afterMs: 5_000, code: 'channel.timeout' },
}
const DTLS_TIMEOUT = { afterMs: 10_000, code: 'dtls.timeout' }
/** A first connection gives up after this many attempts; one that was up never does. */
const FIRST_ATTEMPTS = 3
const BACKOFF = { baseMs: 500, maxMs: 10_000 }
/** Trying again changes nothing; and `peer.replaced` means that another page took over on purpose. */
const PERMANENT: ReadonlySet<string> = new Set([
  'auth.failed',
  'auth.unknown_robot',
  'auth.expired',
  'auth.forbidden',
  'peer.replaced',
  'peer.not_allowed',
  'sdp.invalid',
  'sdp.no_common_codec',
])
/** An original robot takes one page, and keeps one that was killed for up to 45 s: its place may be free soon. */
const BUSY = { code: 'signal.robot_busy', patienceMs: 60_000 }
/** Fewer unanswered pings than this prove nothing: the page itself may have been frozen, and has just begun to ask. */
const PINGS_BEFORE_LOST = 3
/** Silence that is noticed this late proves nothing: the page stood still, and answers may be waiting unread. */
const STALL_MS = 500

export class OperatorPeerMachine {
  private current: PeerPhase = 'idle'
  private attempt = 0
  private wasUp = false
  private busySinceMs: number | null = null
  private deadline: { atMs: number; code: string } | null = null
  private retryAtMs = 0
  private greeted: boolean | null = null
  private heardAtMs = 0
  private pingAtMs = 0
  private unansweredPings = 0
  private doubt: { untilMs: number; patienceMs: number } | null = null
  private why: { code?: string; message?: string } = {}

  /** `draw` gives numbers of [0, 1), for pauses that differ from page to page. */
  constructor(private readonly draw: () => number) {}

  get phase(): PeerPhase {
    return this.current
  }

  /** Why it failed, waits or was closed. */
  get reason(): { code?: string; message?: string } {
    return this.why
  }

  /** True once the robot said hello, false for an original one, null before that is known. */
  get isGreeted(): boolean | null {
    return this.greeted
  }

  /** What the page shows. */
  get publicPhase(): ConnectionPhase {
    switch (this.current) {
      case 'up':
        return 'connected'
      case 'idle':
      case 'failed':
      case 'closed':
        return this.current
      default:
        return this.wasUp ? 'reconnecting' : 'connecting'
    }
  }

  /** When a `deadlinePassed` event is due; null while nothing is. */
  get deadlineMs(): number | null {
    if (this.current === 'waiting') return this.retryAtMs
    if (this.current !== 'up') return this.deadline?.atMs ?? null
    if (this.greeted === null) return this.heardAtMs + HELLO_TIMEOUT_MS
    if (!this.greeted) return null
    const lostAtMs = this.mayBeLost ? this.heardAtMs + PEER_LOST_AFTER_MS : Infinity
    return Math.min(this.pingAtMs, lostAtMs, this.doubt?.untilMs ?? Infinity)
  }

  handle(event: PeerEvent, nowMs: number): PeerEffect[] {
    switch (event.type) {
      case 'connectWanted':
        return this.isResting ? this.beginAnew(nowMs) : []
      case 'disconnectWanted':
        return this.close('closed')
      case 'pageHidden':
        return this.isResting ? [] : this.close('suspended')
      case 'pageShown':
        return this.current === 'suspended' ? this.begin(nowMs) : []
      case 'robotReady':
        return this.retryNow(nowMs)
      case 'broken':
        return this.fail(event, nowMs)
      case 'doubted':
        return this.doubted(event.patienceMs, nowMs)
      case 'deadlinePassed':
        return this.tick(nowMs)
      default:
        return this.advance(event.type, nowMs)
    }
  }

  private get isResting(): boolean {
    return this.current === 'idle' || this.current === 'failed' || this.current === 'closed'
  }

  private get hasPeer(): boolean {
    return !this.isResting && this.current !== 'waiting' && this.current !== 'suspended'
  }

  private get mayBeLost(): boolean {
    return this.unansweredPings >= PINGS_BEFORE_LOST
  }

  private beginAnew(nowMs: number): PeerEffect[] {
    this.attempt = 0
    this.wasUp = false
    this.busySinceMs = null
    return this.begin(nowMs)
  }

  private begin(nowMs: number): PeerEffect[] {
    this.enter('requesting', nowMs)
    this.greeted = null
    return [{ type: 'request' }]
  }

  private retryNow(nowMs: number): PeerEffect[] {
    if (this.current === 'waiting') return this.begin(nowMs)
    // What was offered went to a socket of before, of the robot or of this page.
    if (this.current === 'answering') return [{ type: 'drop', bye: false }, ...this.begin(nowMs)]
    const isHealed = this.current === 'failed' && !PERMANENT.has(this.why.code ?? '')
    return isHealed ? this.beginAnew(nowMs) : []
  }

  private enter(phase: PeerPhase, nowMs: number): void {
    this.current = phase
    const timeout = TIMEOUTS[phase]
    this.deadline = timeout ? { atMs: nowMs + timeout.afterMs, code: timeout.code } : null
  }

  private advance(event: PeerEvent['type'], nowMs: number): PeerEffect[] {
    switch (`${this.current} ${event}`) {
      case 'requesting granted':
        this.enter('offering', nowMs)
        return [{ type: 'makeOffer' }]
      case 'offering offered':
        this.enter('answering', nowMs)
        return []
      case 'answering answered':
        this.enter('linking', nowMs)
        return []
      case 'linking iceConnected':
        this.deadline = { atMs: nowMs + DTLS_TIMEOUT.afterMs, code: DTLS_TIMEOUT.code }
        return []
      case 'linking linkConnected':
        this.enter('opening', nowMs)
        return []
      // Browsers don't promise which of the two is told first.
      case 'linking controlOpened':
      case 'opening controlOpened':
        return this.rise(nowMs)
      case 'up helloHeard':
        return this.greet(nowMs)
      case 'up robotHeard':
        if (this.greeted !== null) this.hear(nowMs)
        return []
      default:
        return []
    }
  }

  private rise(nowMs: number): PeerEffect[] {
    this.enter('up', nowMs)
    this.wasUp = true
    this.why = {}
    this.hear(nowMs)
    return [{ type: 'sendHello' }, { type: 'tellConnected' }]
  }

  private greet(nowMs: number): PeerEffect[] {
    this.hear(nowMs)
    if (this.greeted !== null) return []
    this.greeted = true
    this.attempt = 0
    return this.ping(nowMs)
  }

  private hear(nowMs: number): void {
    this.heardAtMs = nowMs
    this.unansweredPings = 0
    this.doubt = null
  }

  private doubted(patienceMs: number, nowMs: number): PeerEffect[] {
    if (this.current !== 'up' || this.greeted !== true || this.doubt !== null) return []
    this.doubt = { untilMs: nowMs + patienceMs, patienceMs }
    // What was asked before a sleep, or of another network, says nothing.
    this.unansweredPings = 0
    return this.ping(nowMs)
  }

  private ping(nowMs: number): PeerEffect[] {
    this.pingAtMs = nowMs + PING_PERIOD_MS
    this.unansweredPings += 1
    return [{ type: 'sendPing' }]
  }

  private tick(nowMs: number): PeerEffect[] {
    if (this.current === 'waiting') return nowMs >= this.retryAtMs ? this.begin(nowMs) : []
    if (this.current === 'up') return this.tickUp(nowMs)
    const isOver = this.deadline !== null && nowMs >= this.deadline.atMs
    return isOver && this.deadline ? this.fail({ code: this.deadline.code }, nowMs) : []
  }

  private tickUp(nowMs: number): PeerEffect[] {
    if (this.greeted === null) return this.missHello(nowMs)
    if (!this.greeted) return []
    if (this.mayBeLost && nowMs >= this.heardAtMs + PEER_LOST_AFTER_MS) {
      return this.fail({ code: 'peer.lost' }, nowMs)
    }
    if (this.doubt !== null && nowMs >= this.doubt.untilMs) return this.settleDoubt(this.doubt, nowMs)
    return nowMs >= this.pingAtMs ? this.ping(nowMs) : []
  }

  private missHello(nowMs: number): PeerEffect[] {
    const lateMs = nowMs - (this.heardAtMs + HELLO_TIMEOUT_MS)
    if (lateMs > STALL_MS) this.heardAtMs = nowMs
    if (lateMs < 0 || lateMs > STALL_MS) return []
    this.greeted = false
    this.attempt = 0
    return [{ type: 'treatAsOriginal' }]
  }

  private settleDoubt({ untilMs, patienceMs }: { untilMs: number; patienceMs: number }, nowMs: number): PeerEffect[] {
    if (nowMs - untilMs <= STALL_MS) return this.fail({ code: 'peer.lost' }, nowMs)
    this.doubt = { untilMs: nowMs + patienceMs, patienceMs }
    return this.ping(nowMs)
  }

  private fail(why: { code: string; message?: string }, nowMs: number): PeerEffect[] {
    if (!this.hasPeer) return []
    const wasConnected = this.current === 'up'
    this.why = why.message === undefined ? { code: why.code } : { code: why.code, message: why.message }
    const effects: PeerEffect[] = [{ type: 'drop', bye: false }]
    if (wasConnected) effects.push({ type: 'tellDisconnected', ...this.why })
    const isBusy = this.noteBusy(why.code, nowMs)
    this.attempt += 1
    const isFinal = PERMANENT.has(why.code) || (!this.wasUp && !isBusy && this.attempt >= FIRST_ATTEMPTS)
    this.enter(isFinal ? 'failed' : 'waiting', nowMs)
    // Most losses are a change of network that is over when it is noticed: the first try is made at once.
    const isAtOnce = wasConnected && why.code !== 'peer.shutdown'
    this.retryAtMs = isAtOnce ? nowMs : nowMs + backoffDelayMs(this.attempt - 1, this.draw(), BACKOFF)
    this.doubt = null
    if (isFinal) effects.push({ type: 'tellFailed', ...this.why, code: why.code })
    return effects
  }

  /** True while a robot that has somebody else is worth the wait; what fails once it is free is counted from the start. */
  private noteBusy(code: string, nowMs: number): boolean {
    if (code !== BUSY.code && this.busySinceMs !== null) this.attempt = 0
    this.busySinceMs = code === BUSY.code ? (this.busySinceMs ?? nowMs) : null
    return this.busySinceMs !== null && nowMs - this.busySinceMs < BUSY.patienceMs
  }

  private close(phase: 'closed' | 'suspended'): PeerEffect[] {
    if (this.isResting) {
      if (this.current === 'failed') this.current = phase
      return []
    }
    const effects: PeerEffect[] = this.hasPeer ? [{ type: 'drop', bye: true }] : []
    this.current = phase
    this.deadline = null
    this.why = {}
    return [...effects, { type: 'tellDisconnected' }]
  }
}
