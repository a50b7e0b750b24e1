/**
 * Keeps the stop of a robot, purely. It holds until a supervisor clears it. Nothing moves on a phone, so it is safe at once:
 * what a stop silences is its loudspeaker.
 */
import type { Stop, StopAck, StopState } from '@mosaic/protocol'
import type { Identity } from '../signaling/tickets'

/** Stops that are remembered for their acknowledgements; the oldest is forgotten first. */
const MAX_IDS = 64

export class StopLatch {
  private standing: StopState = { isStopped: false, by: '', reason: '' }
  private readonly receivedUs = new Map<string, number>()

  get state(): StopState {
    return this.standing
  }

  get isStopped(): boolean {
    return this.standing.isStopped
  }

  /** Anybody may say it. What to acknowledge, and whether it is news for the others. */
  stop({ id, reason }: Stop, by: Identity, nowUs: number): { ack: StopAck; isNew: boolean } {
    const isNew = !this.standing.isStopped
    if (isNew) {
      this.receivedUs.clear()
      this.standing = { isStopped: true, by: by.name, byAccount: by.account, reason, sinceUs: nowUs }
    }
    const receivedUs = this.receivedUs.get(id) ?? nowUs
    if (!this.receivedUs.has(id) && this.receivedUs.size >= MAX_IDS) this.receivedUs.delete([...this.receivedUs.keys()][0] ?? '')
    this.receivedUs.set(id, receivedUs)
    return { ack: { id, receivedUs, safeUs: receivedUs }, isNew }
  }

  /** The code why not; null if it is cleared. */
  clear(by: Identity): string | null {
    if (by.role !== 'supervisor') return by.role === 'operator' ? 'lease.required' : 'lease.forbidden'
    if (by.isProgram) return 'safety.person_clears'
    this.standing = { isStopped: false, by: by.name, byAccount: by.account, reason: '' }
    return null
  }
}
