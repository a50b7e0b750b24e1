import { RESUME_LIMITS, ResumeSender } from './ResumeSender'

/** A message that waits for a connection, or for the robot's word. */
export interface WaitingMessage {
  value: string | Uint8Array
  stampUs: number
}

/** The open channel. */
export interface StreamPort {
  /** Send under a number that outlives the channel; false: too much waits below, or it is not open. */
  put(message: WaitingMessage, seq: number): boolean
  /** Send under the channel's own number. */
  putPlain(message: WaitingMessage): boolean
}

/** What an empty message costs us: a queue of nothing else is bounded too. */
const MESSAGE_BYTES = 64

/**
 * Sends for a store on a reliable channel: at once where that is possible, kept while there is no connection. Until
 * the robot has said what it takes part in, messages wait.
 */
export class OutgoingStream {
  private readonly sender = new ResumeSender<WaitingMessage>(RESUME_LIMITS)
  private phase: 'held' | 'resumed' | 'plain' | 'away' | 'closed' = 'held'
  private port: StreamPort | null = null

  /** `waits`: what is sent while there is no connection is kept for the next one. */
  constructor(
    private readonly nowMs: () => number,
    private waits: boolean,
  ) {}

  /** Its numbers go on. */
  get isNumbered(): boolean {
    return this.phase !== 'plain' && this.phase !== 'closed'
  }

  /** The number that comes first on the next connection. */
  get upcoming(): number {
    return this.sender.firstSeq
  }

  /** Whether it was accepted. */
  send(value: string | Uint8Array): boolean {
    const { port } = this
    if (this.phase === 'closed' || (port === null && !this.waits)) return false
    const message = { value: typeof value === 'string' ? value : value.slice(), stampUs: Math.round(this.nowMs() * 1000) }
    if (this.phase === 'plain' && this.sender.waiting === 0) return port?.putPlain(message) ?? false
    const sizeBytes = value.length + MESSAGE_BYTES
    if (!this.sender.hasRoom(sizeBytes, this.nowMs())) return false
    if (port !== null && this.phase === 'resumed' && this.sender.waiting === 0) {
      if (!port.put(message, this.sender.nextSeq)) return false
      this.sender.accept(message, sizeBytes, this.nowMs())
      this.sender.wentOut()
      return true
    }
    this.sender.accept(message, sizeBytes, this.nowMs())
    this.pump()
    return true
  }

  /** The channel is open. */
  attach(port: StreamPort): void {
    this.port = port
    this.pump()
  }

  /** The channel is closed. */
  detach(): void {
    this.port = null
  }

  /** Its store is gone, and what it still wanted to say. */
  released(): void {
    this.port = null
    this.sender.abandoned()
  }

  /** Send what waits, as far as the channel takes it; called again when that has drained. */
  pump(): void {
    for (let next = this.sender.upcoming(); this.port !== null && next !== null; next = this.sender.upcoming()) {
      const isOut = this.phase === 'plain' ? this.port.putPlain(next.item) : this.port.put(next.item, next.seq)
      if (!isOut) return
      this.sender.wentOut()
      if (this.phase === 'plain') this.sender.delivered(next.seq)
    }
  }

  delivered(seq: number): void {
    this.sender.delivered(seq)
  }

  /** The connection is gone and will be made anew. */
  lost(): void {
    this.port = null
    this.sender.detached()
    if (this.phase !== 'closed') this.phase = 'away'
  }

  /** The robot has everything up to `received`. How many messages are lost by now. */
  resumed(received: number | null): number {
    this.phase = 'resumed'
    this.sender.forgetOld(this.nowMs())
    const lost = this.sender.resumed(received)
    this.pump()
    return lost
  }

  /**
   * The robot does not number it across connections: what waits goes out once, what went out is not repeated, and
   * nothing is kept any more while there is no connection.
   */
  plain(): number {
    this.phase = 'plain'
    this.waits = false
    this.sender.forgetOld(this.nowMs())
    const lost = this.sender.resumed(null)
    this.pump()
    return lost
  }

  /** It has ended for good. How many messages may not have arrived. */
  close(): number {
    this.phase = 'closed'
    this.port = null
    return this.sender.abandoned()
  }
}
