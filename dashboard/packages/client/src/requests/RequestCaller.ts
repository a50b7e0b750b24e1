import type { Catalogue } from '@mosaic/protocol'
import { randomId } from '../platform/randomId'
import type { BidirectionalStore } from '../stores/BidirectionalStore'
import { DeadlineTimer } from '../timing/DeadlineTimer'
import { nowMs } from '../timing/clock'
import { MosaicError } from '../words/MosaicError'
import type { StoreState } from '../words/types'
import { Asking, type LostRequest } from './Asking'
import { replyOf } from './requestWords'

/** How long to wait for an answer, where nobody says and the robot does not either. */
const UNKNOWN_PATIENCE_MS = 30_000
/** What a question and its answer may take on their way, beside the time that the connector gives itself. */
const ON_THE_WAY_MS = 5_000

/** How long to wait for an answer of this connector, where nobody says: a little longer than it gives itself. */
export function answerPatienceMs(catalogue: Pick<Catalogue, 'entries'> | null, label: string): number {
  const withinS = catalogue?.entries.find((entry) => entry.label === label)?.answerWithinS
  return withinS === undefined ? UNKNOWN_PATIENCE_MS : withinS * 1000 + ON_THE_WAY_MS
}

/** What may be said with a question. */
export interface RequestOptions {
  /** How long to wait for the answer; a little longer than the connector's class gives itself where nothing is said. */
  readonly timeoutMs?: number
  /** Given what the connector tells before its answer. */
  readonly onProgress?: (progress: unknown) => void
  /** Its abortion takes the request back. */
  readonly signal?: AbortSignal
}

interface Waiting {
  readonly question: unknown
  readonly onProgress: ((progress: unknown) => void) | undefined
  readonly resolve: (answer: unknown) => void
  readonly reject: (error: MosaicError) => void
  isSent: boolean
}

/** Asks one connector by its store, and hands every answer to whoever asked. */
export class RequestCaller {
  private readonly asking = new Asking(randomId().slice(0, 8))
  private readonly waiting = new Map<string, Waiting>()
  private readonly timer = new DeadlineTimer({ now: nowMs }, () => this.end(this.asking.timePassed(nowMs())))
  private readonly leave: readonly (() => void)[]

  constructor(private readonly store: BidirectionalStore) {
    this.leave = [
      store.subscribe((data) => this.heard(data)),
      store.onAfterConnected(() => this.sendWaiting()),
      store.onAfterDisconnected((state) => this.disconnected(state)),
      store.state.subscribe(() => this.stateChanged()),
      // Some of what was asked or answered will never arrive, and nobody knows which.
      store.gap.subscribe(() => this.end(this.asking.lost('request.lost'))),
    ]
  }

  /**
   * Ask, and wait for the answer. Rejected with a `MosaicError`: the robot's code and text where it refused, else
   * `request.timeout`, `request.lost`, `request.cancelled` or why nothing may be sent.
   */
  request(question: unknown, { timeoutMs = UNKNOWN_PATIENCE_MS, onProgress, signal }: RequestOptions = {}): Promise<unknown> {
    return new Promise((resolve, reject) => {
      if (signal?.aborted === true || !this.asking.hasRoom) {
        reject(new MosaicError(this.asking.hasRoom ? 'request.cancelled' : 'request.too_many'))
        return
      }
      const id = this.asking.asked(nowMs() + timeoutMs)
      this.waiting.set(id, { question, onProgress, resolve, reject, isSent: false })
      signal?.addEventListener('abort', () => this.cancel(id), { once: true })
      this.timer.set(this.asking.deadlineMs)
      this.send(id)
    })
  }

  /** Take every request back, and listen no more. */
  close(): void {
    for (const id of [...this.waiting.keys()]) this.cancel(id)
    for (const leave of this.leave) leave()
    this.timer.set(null)
  }

  private cancel(id: string): void {
    if (!this.asking.forgotten(id)) return
    this.takeBack(id)
    this.fail(id, new MosaicError('request.cancelled'))
    this.timer.set(this.asking.deadlineMs)
  }

  private takeBack(id: string): void {
    if (this.waiting.get(id)?.isSent === true) this.store.sendJson({ id, cancel: true })
  }

  private sendWaiting(): void {
    for (const [id, one] of [...this.waiting]) if (!one.isSent) this.send(id)
  }

  /** A store that is not open yet gets the question when it is. */
  private send(id: string): void {
    const one = this.waiting.get(id)
    const { phase, message } = this.store.state.get()
    if (one === undefined || phase === 'waiting' || phase === 'closed') return
    one.isSent = phase !== 'mismatch' && this.store.sendJson({ id, question: one.question })
    if (one.isSent) return
    this.asking.forgotten(id)
    const isUnknown = phase === 'mismatch'
    const code = isUnknown ? 'channel.unknown_label' : (this.store.sendBlocked.get()?.code ?? 'request.not_sent')
    this.fail(id, new MosaicError(code, isUnknown ? message : ''))
  }

  private heard(data: ArrayBuffer): void {
    const read = replyOf(data)
    const reply = read === null ? null : this.asking.heard(read)
    if (reply === null) return
    const one = this.waiting.get(reply.id)
    if (reply.kind === 'progress') {
      one?.onProgress?.(reply.progress)
      return
    }
    this.waiting.delete(reply.id)
    if (reply.kind === 'answer') one?.resolve(reply.answer)
    else one?.reject(new MosaicError(reply.code, reply.message))
    this.timer.set(this.asking.deadlineMs)
  }

  private stateChanged(): void {
    const { phase, message } = this.store.state.get()
    if (phase === 'mismatch') this.end(this.asking.lost('channel.unknown_label'), message)
  }

  private disconnected({ phase }: StoreState): void {
    if (phase !== 'reconnecting' || !this.store.outlivesConnection) this.end(this.asking.lost('request.lost'))
  }

  private end(lost: readonly LostRequest[], message = ''): void {
    for (const { id, code } of lost) {
      if (code === 'request.timeout') this.takeBack(id)
      this.fail(id, new MosaicError(code, message))
    }
    this.timer.set(this.asking.deadlineMs)
  }

  private fail(id: string, error: MosaicError): void {
    const one = this.waiting.get(id)
    this.waiting.delete(id)
    one?.reject(error)
  }
}
