/**
 * Decides the life of one operator's peer connection, seen from the robot, purely: every phase is bounded, every end has a
 * code. The twin of `mosaic_core/machines/peers/peer_of_robot.py`, without originals: they are not taken.
 */
import { PEER_LOST_AFTER_MS } from '@mosaic/protocol'
import type { DeadlinePassed, Machine } from '@mosaic/client/parts'

export type RobotPeerPhase = 'answering' | 'connecting' | 'securing' | 'greeting' | 'open' | 'closed'

export type RobotPeerEvent =
  | { type: 'answered' }
  /** ICE has a path. */
  | { type: 'securing' }
  | { type: 'connected' }
  | { type: 'helloHeard' }
  /** Anything on the control channel. */
  | { type: 'operatorHeard' }
  | { type: 'byeHeard'; code: string; message?: string }
  | { type: 'broken'; code: string; message?: string }
  /** The robot, or somebody through the server, wants it closed. */
  | { type: 'closeWanted'; code: string; message?: string }
  | DeadlinePassed

export type RobotPeerEffect =
  /** It speaks our words: tell it what there is. */
  | { type: 'greet' }
  /** The end, once. `sayBye`: the other side is still there to hear it. */
  | { type: 'close'; code: string; message: string; sayBye: boolean }

/** Milliseconds a phase may take, and the code when it takes longer. */
const TIMEOUTS: Partial<Record<RobotPeerPhase, { afterMs: number; code: string }>> = {
  answering: { afterMs: 15_000, code: 'sdp.timeout' },
  connecting: { afterMs: 20_000, code: 'ice.timeout' },
  securing: { afterMs: 10_000, code: 'dtls.timeout' },
  greeting: { afterMs: 10_000, code: 'channel.timeout' },
}
/** A deadline noticed this late means that the page stood still; words may be waiting unread. */
const STALL_MS = 500

export class RobotPeerMachine implements Machine<RobotPeerEvent, RobotPeerEffect> {
  private current: RobotPeerPhase = 'answering'
  private dueMs: number | null

  constructor(nowMs: number) {
    this.dueMs = nowMs + (TIMEOUTS.answering?.afterMs ?? 0)
  }

  get phase(): RobotPeerPhase {
    return this.current
  }

  get deadlineMs(): number | null {
    return this.dueMs
  }

  handle(event: RobotPeerEvent, nowMs: number): RobotPeerEffect[] {
    if (this.current === 'closed') return []
    switch (event.type) {
      case 'answered':
        return this.advance('connecting', ['answering'], nowMs)
      case 'securing':
        return this.advance('securing', ['answering', 'connecting'], nowMs)
      case 'connected':
        return this.advance('greeting', ['answering', 'connecting', 'securing'], nowMs)
      case 'helloHeard':
        return this.hello(nowMs)
      case 'operatorHeard':
        if (this.current === 'open') this.dueMs = nowMs + PEER_LOST_AFTER_MS
        return []
      case 'byeHeard':
        return this.close(event.code, event.message, false)
      case 'broken':
        return this.close(this.codeOf(event.code), event.message, false)
      case 'closeWanted':
        return this.close(event.code, event.message, this.current === 'open')
      case 'deadlinePassed':
        return this.overdue(nowMs)
    }
  }

  private advance(to: RobotPeerPhase, from: readonly RobotPeerPhase[], nowMs: number): RobotPeerEffect[] {
    if (!from.includes(this.current)) return []
    this.current = to
    this.dueMs = nowMs + (TIMEOUTS[to]?.afterMs ?? 0)
    return []
  }

  // A message can overtake the event that says "connected": what is heard is there.
  private hello(nowMs: number): RobotPeerEffect[] {
    const isFirst = this.current !== 'open'
    this.current = 'open'
    this.dueMs = nowMs + PEER_LOST_AFTER_MS
    return isFirst ? [{ type: 'greet' }] : []
  }

  private codeOf(code: string): string {
    return this.current === 'open' || this.current === 'greeting' ? 'peer.lost' : code
  }

  private overdue(nowMs: number): RobotPeerEffect[] {
    if (this.dueMs === null || nowMs < this.dueMs) return []
    if (this.current !== 'open') return this.close(TIMEOUTS[this.current]?.code ?? 'peer.lost', '', false)
    if (nowMs - this.dueMs > STALL_MS) {
      this.dueMs = nowMs + STALL_MS
      return []
    }
    return this.close('peer.lost', 'nothing was heard from the operator', false)
  }

  private close(code: string, message: string | undefined, sayBye: boolean): RobotPeerEffect[] {
    this.current = 'closed'
    this.dueMs = null
    return [{ type: 'close', code, message: message ?? '', sayBye }]
  }
}
