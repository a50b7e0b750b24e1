import type { RequestReply } from './requestWords'

/** As many as a robot takes of one operator. */
export const MAX_ASKED = 16

/** The end of a request that did not come from the robot. */
export interface LostRequest {
  readonly id: string
  readonly code: string
}

/**
 * Keeps the requests that were sent to one connector: each gets one end, its own. What the robot says about a request
 * that has ended, or was never asked, is not for anybody.
 */
export class Asking {
  private numbers = 0
  private readonly dueAtMs = new Map<string, number>()

  /** `prefix`: chosen at random, so that two pages of one operator never use the same id. */
  constructor(private readonly prefix: string) {}

  /** Requests that have not ended. */
  get size(): number {
    return this.dueAtMs.size
  }

  get hasRoom(): boolean {
    return this.dueAtMs.size < MAX_ASKED
  }

  /** The id of a new request. */
  asked(dueAtMs: number): string {
    this.numbers += 1
    const id = `${this.prefix}-${this.numbers}`
    this.dueAtMs.set(id, dueAtMs)
    return id
  }

  /** The word, if it is about a request that has not ended; anything but progress ends it. */
  heard(reply: RequestReply): RequestReply | null {
    if (!this.dueAtMs.has(reply.id)) return null
    if (reply.kind !== 'progress') this.dueAtMs.delete(reply.id)
    return reply
  }

  /** Whoever asked wants no answer any more; false: it had ended before. */
  forgotten(id: string): boolean {
    return this.dueAtMs.delete(id)
  }

  /** The way to the robot is gone, and with it the answers to all. */
  lost(code: string): LostRequest[] {
    const lost = [...this.dueAtMs.keys()].map((id) => ({ id, code }))
    this.dueAtMs.clear()
    return lost
  }

  /** When `timePassed` has something to do. */
  get deadlineMs(): number | null {
    return this.dueAtMs.size === 0 ? null : Math.min(...this.dueAtMs.values())
  }

  timePassed(nowMs: number): LostRequest[] {
    const late = [...this.dueAtMs].filter(([, dueMs]) => nowMs >= dueMs)
    return late.map(([id]) => {
      this.dueAtMs.delete(id)
      return { id, code: 'request.timeout' }
    })
  }
}
