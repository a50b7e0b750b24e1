/** Follows one stop, from being said until the robot stands still, purely: when to say it again, and how long everything took. */
import { STOP_REPEAT_MS, type StopAck } from '@mosaic/protocol'
import type { StopReport, ZerosReport } from '../words/views'

/** How long an acknowledged stop is repeated to learn when the safe actions have returned. */
export const SAFE_PATIENCE_MS = 2000

export class StopCourse {
  private progress: StopReport
  private acknowledgedAtMs: number | null = null
  private sentAtMs: number | null = null

  constructor(
    id: string,
    reason: string,
    private readonly saidAtMs: number,
  ) {
    this.progress = { id, reason, phase: 'sending', copies: 0, acknowledgedMs: null, receivedMs: null, safeMs: null }
  }

  /** A new object whenever something changed. */
  get report(): StopReport {
    return this.progress
  }

  get isAcknowledged(): boolean {
    return this.acknowledgedAtMs !== null
  }

  isOver(nowMs: number): boolean {
    const { phase } = this.progress
    if (phase === 'sending') return false
    return phase !== 'acknowledged' || nowMs - (this.acknowledgedAtMs ?? 0) >= SAFE_PATIENCE_MS
  }

  /** True when it is time for another copy; a burst of late ticks makes one. */
  isDue(nowMs: number): boolean {
    return !this.isOver(nowMs) && (this.sentAtMs === null || nowMs - this.sentAtMs >= STOP_REPEAT_MS / 2)
  }

  sent(nowMs: number): void {
    this.sentAtMs = nowMs
    this.progress = { ...this.progress, copies: this.progress.copies + 1 }
  }

  /** `toPageMs`: a moment of the robot's clock on ours; null while the clocks have not been compared. */
  acknowledged(ack: StopAck, nowMs: number, toPageMs: (robotUs: number) => number | null): void {
    if (ack.id !== this.progress.id || this.isOver(nowMs)) return
    this.acknowledgedAtMs ??= nowMs
    const since = (robotUs: number | undefined): number | null => {
      const atMs = robotUs === undefined ? null : toPageMs(robotUs)
      return atMs === null ? null : Math.max(0, atMs - this.saidAtMs)
    }
    this.progress = {
      ...this.progress,
      phase: ack.safeUs === undefined ? 'acknowledged' : 'safe',
      acknowledgedMs: this.acknowledgedAtMs - this.saidAtMs,
      receivedMs: since(ack.receivedUs),
      safeMs: since(ack.safeUs),
    }
  }

  /** Nobody is there to hear it. */
  abandoned(phase: 'unconfirmed' | 'unavailable', zeros?: ZerosReport): void {
    if (this.progress.phase !== 'sending') return
    this.progress = { ...this.progress, phase, ...(zeros === undefined ? {} : { zeros }) }
  }
}
