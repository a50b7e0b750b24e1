import { after, before, distance, isNewer } from './serial'

/**
 * The most that may wait for one channel, and how long something may wait for a connection. `inFlight…`: what is kept
 * besides on a live connection, of which the receiver has not told yet that it came.
 */
export interface ResumeLimits {
  messages: number
  sizeBytes: number
  ageMs: number
  inFlightMessages: number
  inFlightBytes: number
}

export const RESUME_LIMITS: ResumeLimits = {
  messages: 512,
  sizeBytes: 2 * 1024 * 1024,
  ageMs: 60_000,
  inFlightMessages: 4096,
  inFlightBytes: 16 * 1024 * 1024,
}

/** One message with its number; repeated: it went out before, on a connection that was lost. */
export interface Numbered<T> {
  seq: number
  item: T
  isRepeated: boolean
}

interface Kept<T> {
  seq: number
  item: T
  sizeBytes: number
  atMs: number
  wasSent: boolean
}

/**
 * Sends on a channel that outlives its connection: keeps and repeats what the receiver has not told to have.
 * The twin of `mosaic_core/machines/delivery/resume.py`; both replay `tests/wire/resume.json`.
 */
export class ResumeSender<T> {
  private kept: Kept<T>[] = []
  private bytes = 0
  private sent = 0
  private next = 1
  private confirmed = 0
  private wasAttached = false
  private attached = false
  private lostCount = 0
  private resentCount = 0

  constructor(private readonly limits: ResumeLimits = RESUME_LIMITS) {}

  /** Messages may go out now. */
  get isAttached(): boolean {
    return this.attached
  }

  get lost(): number {
    return this.lostCount
  }

  get resent(): number {
    return this.resentCount
  }

  /** Messages that have not gone out on this connection. */
  get waiting(): number {
    return this.kept.length - this.sent
  }

  /** Messages that are kept. */
  get unconfirmed(): number {
    return this.kept.length
  }

  get sizeBytes(): number {
    return this.bytes
  }

  /** The number of the next message that is accepted. */
  get nextSeq(): number {
    return this.next
  }

  /** The number that would come first on a new connection. */
  get firstSeq(): number {
    return this.kept[0]?.seq ?? this.next
  }

  /** Whether a message would be accepted. One always is where nothing is kept. */
  hasRoom(sizeBytes: number, nowMs: number): boolean {
    this.forgetOld(nowMs)
    return this.kept.length === 0 || !this.isFull(sizeBytes)
  }

  /** Number and keep a message; false if there is no room. What was accepted is kept until it is confirmed. */
  accept(item: T, sizeBytes: number, nowMs: number): boolean {
    if (!this.hasRoom(sizeBytes, nowMs)) return false
    this.kept.push({ seq: this.next, item, sizeBytes, atMs: nowMs, wasSent: false })
    this.bytes += sizeBytes
    this.next = after(this.next)
    return true
  }

  /** What has waited too long for a connection is lost; say so before `resumed`. */
  forgetOld(nowMs: number): void {
    while (!this.attached && this.kept[0] !== undefined && nowMs - this.kept[0].atMs > this.limits.ageMs) this.dropFirst()
  }

  /** What has to go out next; `wentOut` says that it did. */
  upcoming(): Numbered<T> | null {
    const kept = this.attached ? this.kept[this.sent] : undefined
    return kept === undefined ? null : { seq: kept.seq, item: kept.item, isRepeated: kept.wasSent }
  }

  /** The `upcoming` message is on its way. */
  wentOut(): void {
    const kept = this.kept[this.sent]
    if (kept === undefined) return
    if (kept.wasSent) this.resentCount += 1
    kept.wasSent = true
    this.sent += 1
  }

  /** The receiver has everything up to `seq`; a number that was never sent is not believed. */
  delivered(seq: number): void {
    const lastSent = before(this.kept[this.sent]?.seq ?? this.next)
    if (this.attached && !isNewer(seq, lastSent)) this.confirm(seq)
  }

  /** The connection is gone; from now on messages wait. */
  detached(): void {
    this.attached = false
    this.sent = 0
  }

  /**
   * A new connection is up, whose receiver has everything up to `received`; null: it remembers nothing, so what went
   * out may have acted and is not repeated. The number of messages that are lost by now.
   */
  resumed(received: number | null): number {
    const isFirst = !this.wasAttached
    this.wasAttached = this.attached = true
    this.sent = 0
    if (received === null) {
      while (this.kept[0]?.wasSent === true) this.dropFirst()
      return this.countLost()
    }
    if (this.isBeyond(received, isFirst)) {
      // It knows an older sender than this one: go on where that ended.
      const lost = this.countLost()
      this.renumber(after(received))
      return lost
    }
    this.confirm(received)
    return this.countLost()
  }

  /** Nobody will come back for what is kept: all that was not confirmed is lost. */
  abandoned(): number {
    this.kept = []
    this.bytes = this.sent = 0
    return this.countLost()
  }

  // No message of this sender had that number.
  private isBeyond(seq: number, isFirst: boolean): boolean {
    const last = before(this.next)
    return isFirst ? distance(this.confirmed, seq) > distance(this.confirmed, last) : isNewer(seq, last)
  }

  private isFull(sizeBytes: number): boolean {
    const { messages, sizeBytes: waitingBytes, inFlightMessages, inFlightBytes } = this.limits
    const most = messages + (this.attached ? inFlightMessages : 0)
    const mostBytes = waitingBytes + (this.attached ? inFlightBytes : 0)
    return this.waiting >= messages || this.kept.length >= most || this.bytes + sizeBytes > mostBytes
  }

  private confirm(seq: number): void {
    while (this.kept[0] !== undefined && !isNewer(this.kept[0].seq, seq)) this.dropFirst()
    if (isNewer(seq, this.confirmed)) this.confirmed = seq
  }

  private dropFirst(): void {
    this.bytes -= this.kept.shift()?.sizeBytes ?? 0
    this.sent = Math.max(0, this.sent - 1)
  }

  private renumber(first: number): void {
    this.kept.forEach((kept, offset) => (kept.seq = (first + offset) >>> 0))
    this.next = (first + this.kept.length) >>> 0
    this.confirmed = before(first)
  }

  // Between what is confirmed and what is still kept there is nothing any more.
  private countLost(): number {
    const count = distance(this.confirmed, this.firstSeq) - 1
    this.confirmed = before(this.firstSeq)
    this.lostCount += count
    return count
  }
}
