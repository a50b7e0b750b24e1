/**
 * Decides when there is a second peer connection for bulk data. Pure; the twin of
 * `mosaic_core/machines/peers/bulk_of_operator.py`: made when the first bulk store wants it, tried again with back-off, and nobody waits longer for it than `SETUP_TIMEOUT_MS`.
 */
import { backoffDelayMs } from '../timing/backoff'
import type { DeadlinePassed } from '../timing/MachineDriver'

/** `none`: nobody wanted one, or the robot knows none. `failed`: bulk goes over the main connection meanwhile. */
export type BulkPhase = 'none' | 'connecting' | 'up' | 'failed'

export const SETUP_TIMEOUT_MS = 5000
export const PING_PERIOD_MS = 2000
/** Answers to pings wait behind the bulk that SCTP holds, so it is longer than the main connection's. */
export const LOST_AFTER_MS = 8000
/** A deadline noticed this late means that the page was frozen; answers may be waiting unread. */
const STALL_MS = 1000
const RETRY = { baseMs: 3000, maxMs: 120_000 }
/** A bulk connection that was up for this long begins to count its failures anew. */
const STABLE_MS = 30_000

export type BulkEvent =
  /** A bulk store is there. */
  | { type: 'wanted' }
  /** Its own channel is open: everything below it works. */
  | { type: 'opened'; attempt: number }
  | { type: 'heard'; attempt: number }
  /** It can't be made, or is gone. `isTold`: the robot said so itself. */
  | { type: 'failed'; attempt: number; code: string; isTold?: boolean }
  | DeadlinePassed

export type BulkEffect =
  /** Make a transport and offer it under this number. */
  | { type: 'begin'; attempt: number }
  /** Bulk channels open on it from now on. */
  | { type: 'use' }
  | { type: 'ping' }
  /** Close the transport; bulk channels open on the main connection. */
  | { type: 'fallBack'; attempt: number; code: string; tellsRobot: boolean }

/** Decides when one main connection has a second beside it; times are milliseconds of any monotonic clock, `draw` gives numbers of [0, 1). */
export class OperatorBulkMachine {
  state: BulkPhase = 'none'
  /** Why it failed; empty otherwise. */
  code = ''
  /** When `deadlinePassed` is to be said; null: never. */
  deadlineMs: number | null = null
  private attempt = 0
  private failures = 0
  private upAtMs = 0
  private pingAtMs = 0
  private lostAtMs = 0

  constructor(private readonly draw: () => number) {}

  handle(event: BulkEvent, nowMs: number): BulkEffect[] {
    if (event.type === 'wanted') return this.state === 'none' ? this.begin(nowMs) : []
    if (event.type === 'deadlinePassed') return this.deadlineMs !== null && nowMs >= this.deadlineMs ? this.overdue(nowMs) : []
    const isCurrent = event.attempt === this.attempt && (this.state === 'connecting' || this.state === 'up')
    if (!isCurrent) return []
    if (event.type === 'opened') return this.opened(nowMs)
    if (event.type === 'failed') return this.failed(event.code, nowMs, event.isTold !== true)
    if (this.state === 'up') this.lostAtMs = nowMs + LOST_AFTER_MS
    return []
  }

  private begin(nowMs: number): BulkEffect[] {
    this.attempt += 1
    this.state = 'connecting'
    this.code = ''
    this.deadlineMs = nowMs + SETUP_TIMEOUT_MS
    return [{ type: 'begin', attempt: this.attempt }]
  }

  private opened(nowMs: number): BulkEffect[] {
    if (this.state === 'up') return []
    this.state = 'up'
    this.upAtMs = nowMs
    this.lostAtMs = nowMs + LOST_AFTER_MS
    this.pingAtMs = this.deadlineMs = nowMs + PING_PERIOD_MS
    return [{ type: 'use' }]
  }

  private overdue(nowMs: number): BulkEffect[] {
    if (this.state === 'failed') return this.begin(nowMs)
    if (this.state === 'connecting') return this.failed('ice.timeout', nowMs, true)
    if (nowMs >= this.lostAtMs) {
      if (nowMs - this.pingAtMs <= STALL_MS) return this.failed('peer.lost', nowMs, true)
      this.lostAtMs = nowMs + PING_PERIOD_MS + STALL_MS
    }
    this.pingAtMs = this.deadlineMs = nowMs + PING_PERIOD_MS
    return [{ type: 'ping' }]
  }

  private failed(code: string, nowMs: number, tellsRobot: boolean): BulkEffect[] {
    const wasStable = this.state === 'up' && nowMs - this.upAtMs >= STABLE_MS
    this.failures = wasStable ? 0 : this.failures
    this.state = 'failed'
    this.code = code
    this.deadlineMs = nowMs + backoffDelayMs(this.failures, this.draw(), RETRY)
    this.failures += 1
    return [{ type: 'fallBack', attempt: this.attempt, code, tellsRobot }]
  }
}
