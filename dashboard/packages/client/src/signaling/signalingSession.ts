/**
 * Decides the life of a signaling socket, purely, for both sides: it signs in, answers pings, notices silence and comes back
 * with back-off after every end but a refusal. How a side says who it is, is its own.
 */
import {
  agreedExtensions,
  EXTENSIONS,
  reasonOfClose,
  reasonOfResult,
  ResultCode,
  type SignalingMessage,
  type SignalingMessages,
} from '@mosaic/protocol'
import { backoffDelayMs } from '../timing/backoff'
import type { DeadlinePassed } from '../timing/MachineDriver'
import type { ServerState } from '../words/types'

export type SignalingPhase = 'off' | 'opening' | 'authorizing' | 'online' | 'waiting' | 'refused'

export type SignalingEvent =
  | { type: 'started'; token: string }
  | { type: 'stopped' }
  | { type: 'opened' }
  | { type: 'closed'; closeCode: number }
  | { type: 'heard'; message: SignalingMessage }
  /** The machine's network is back, or another one. */
  | { type: 'networkChanged' }
  /** Something was asked that is answered at once: silence means that the socket is dead without knowing it. */
  | { type: 'doubted' }
  | DeadlinePassed

export type SignalingEffect =
  | { type: 'open' }
  | { type: 'close' }
  | { [T in keyof SignalingMessages]: { type: 'send'; word: T; data: SignalingMessages[T] } }[keyof SignalingMessages]
  | { type: 'tellRefused'; code: string }
  | { type: 'tellMessage'; message: SignalingMessage }

const OPEN_TIMEOUT_MS = 10_000
/** A server that pings does so every 5 s; three of them missing means that the line is dead. */
const SILENCE_MS = 15_000
/** A server that is there answers within this time. */
const PROBE_MS = 700
const BACKOFF = { baseMs: 500, maxMs: 10_000 }

export abstract class SignalingSession {
  protected current: SignalingPhase = 'off'
  protected token = ''
  private attempt = 0
  private wakeMs: number | null = null
  private pings = false
  private isDoubted = false

  /** The extensions that both sides know, since the server asked who we are. */
  protected agreed: Record<string, number> = {}

  constructor(private readonly draw: () => number) {}

  /** Who we are, without extensions. */
  protected abstract credentials(): SignalingMessages['authorize']

  /** The server took us. */
  protected abstract accepted(): SignalingEffect[]

  get phase(): SignalingPhase {
    return this.current
  }

  /** What the page shows; a retry in the background is no news. */
  get state(): ServerState {
    if (this.current === 'online') return 'online'
    const isFirst = this.attempt === 0 && (this.current === 'opening' || this.current === 'authorizing')
    return isFirst ? 'connecting' : 'offline'
  }

  /** When a `deadlinePassed` event is due; null while nothing is. */
  get deadlineMs(): number | null {
    return this.wakeMs
  }

  handle(event: SignalingEvent, nowMs: number): SignalingEffect[] {
    switch (event.type) {
      case 'started':
        this.token = event.token
        this.attempt = 0
        return [...this.stop(), ...this.open(nowMs)]
      case 'stopped':
        return this.stop()
      case 'opened':
        if (this.current === 'opening') this.enter('authorizing', nowMs + OPEN_TIMEOUT_MS)
        return []
      case 'closed':
        return this.closed(event.closeCode, nowMs)
      case 'heard':
        return this.hasSocket ? this.heard(event.message, nowMs) : []
      case 'networkChanged':
        return this.networkChanged(nowMs)
      case 'doubted':
        if (this.current === 'online') this.doubt(nowMs)
        return []
      case 'deadlinePassed':
        return this.wakeMs !== null && nowMs >= this.wakeMs ? this.woken(nowMs) : []
    }
  }

  private get hasSocket(): boolean {
    return this.current === 'opening' || this.current === 'authorizing' || this.current === 'online'
  }

  private enter(phase: SignalingPhase, wakeMs: number | null): void {
    this.current = phase
    this.wakeMs = wakeMs
  }

  protected networkChanged(nowMs: number): SignalingEffect[] {
    if (this.current === 'waiting') return this.open(nowMs)
    // It may hang on a way that is gone.
    return this.current === 'opening' || this.current === 'authorizing' ? [{ type: 'close' }, ...this.open(nowMs)] : []
  }

  private doubt(nowMs: number): void {
    if (this.isDoubted) return
    this.isDoubted = true
    this.wakeMs = nowMs + PROBE_MS
  }

  protected open(nowMs: number): SignalingEffect[] {
    this.enter('opening', nowMs + OPEN_TIMEOUT_MS)
    this.pings = this.isDoubted = false
    return [{ type: 'open' }]
  }

  private stop(): SignalingEffect[] {
    const effects: SignalingEffect[] = this.hasSocket ? [{ type: 'close' }] : []
    this.enter('off', null)
    return effects
  }

  private woken(nowMs: number): SignalingEffect[] {
    if (this.current === 'waiting') return this.open(nowMs)
    if (this.isDoubted) return [{ type: 'close' }, ...this.open(nowMs)]
    return [{ type: 'close' }, ...this.retryLater(nowMs)]
  }

  private closed(closeCode: number, nowMs: number): SignalingEffect[] {
    if (!this.hasSocket) return []
    const reason = reasonOfClose(closeCode)
    const isFinal = reason?.startsWith('auth.') || reason === 'signal.replaced'
    return reason && isFinal ? this.refuse(reason) : this.retryLater(nowMs)
  }

  private retryLater(nowMs: number): SignalingEffect[] {
    this.enter('waiting', nowMs + backoffDelayMs(this.attempt, this.draw(), BACKOFF))
    this.attempt += 1
    return []
  }

  private refuse(code: string): SignalingEffect[] {
    this.enter('refused', null)
    return [{ type: 'tellRefused', code }]
  }

  private heard(message: SignalingMessage, nowMs: number): SignalingEffect[] {
    this.isDoubted = false
    if (this.current === 'online') this.wakeMs = this.pings ? nowMs + SILENCE_MS : null
    switch (message.type) {
      case 'authorize.req':
        return [this.authorize(message.data.extensions)]
      case 'authorize.res':
        return this.judged(message.data)
      case 'ping.ping':
        this.pings = true
        if (this.current === 'online') this.wakeMs = nowMs + SILENCE_MS
        return [{ type: 'send', word: 'ping.pong', data: message.data }]
      case 'error':
        // The server echoes the request's type with or without `.res`.
        return message.requestType.startsWith('authorize') ? this.judged(message.code) : [{ type: 'tellMessage', message }]
      default:
        return this.heardMore(message)
    }
  }

  /** What is not about the socket itself. */
  protected heardMore(message: SignalingMessage): SignalingEffect[] {
    return [{ type: 'tellMessage', message }]
  }

  private authorize(offered: Record<string, number> | undefined): SignalingEffect {
    this.agreed = offered ? agreedExtensions(offered, EXTENSIONS) : {}
    // An original server refuses keys that it does not know.
    const data = offered ? { ...this.credentials(), extensions: this.agreed } : this.credentials()
    return { type: 'send', word: 'authorize', data }
  }

  private judged(result: number): SignalingEffect[] {
    if (result === ResultCode.SUCCESS) return this.accepted()
    return [{ type: 'close' }, ...this.refuse(reasonOfResult(result) ?? 'auth.failed')]
  }

  /** The session can be used. */
  protected becomeOnline(): SignalingEffect[] {
    this.attempt = 0
    this.enter('online', null)
    return []
  }
}
