import type { JournalEntry, JournalRead, Refusal } from '@mosaic/protocol'
import { MosaicError } from '../words/MosaicError'
import { whyOf, type ClearReport, type Why } from '../words/views'

const PATIENCE_MS = 5000

interface Waiting<T> {
  question: JournalRead | null
  settle: (answer: T | Why) => void
  timer: ReturnType<typeof setTimeout> | null
}

/** Questions that the robot answers without naming them: one is asked at a time, the others wait their turn. */
class Queue<T> {
  private readonly waiting: Waiting<T>[] = []

  constructor(private readonly ask: (question: JournalRead | null) => boolean) {}

  put(question: JournalRead | null): Promise<T | Why> {
    return new Promise((settle) => {
      this.waiting.push({ question, settle, timer: null })
      if (this.waiting.length === 1) this.begin()
    })
  }

  get isEmpty(): boolean {
    return this.waiting.length === 0
  }

  answer(answer: T | Why): void {
    const first = this.waiting.shift()
    if (!first) return
    if (first.timer !== null) clearTimeout(first.timer)
    first.settle(answer)
    this.begin()
  }

  answerAll(answer: Why): void {
    for (const one of this.waiting.splice(0)) {
      if (one.timer !== null) clearTimeout(one.timer)
      one.settle(answer)
    }
  }

  private begin(): void {
    const first = this.waiting[0]
    if (!first) return
    first.timer = setTimeout(() => this.answer({ code: 'signal.timeout' }), PATIENCE_MS)
    if (!this.ask(first.question)) this.answer({ code: 'peer.lost' })
  }
}

/** The way to the robot, while there is one. */
export interface QuestionLink {
  send(type: 'journal.read', question: JournalRead): boolean
  send(type: 'stop.clear', nothing: object): boolean
}

/** Waits for what the page asked the robot: pages of the journal, and what came of clearing the stop. */
export class Answers {
  private readonly journals: Queue<readonly JournalEntry[]>
  private readonly clears: Queue<true>
  private clearing: Promise<ClearReport> | null = null

  constructor(link: QuestionLink) {
    this.journals = new Queue((question) => link.send('journal.read', question ?? { limit: 100 }))
    this.clears = new Queue(() => link.send('stop.clear', {}))
  }

  /** Rejects with `MosaicError`. */
  async journal(question: JournalRead): Promise<readonly JournalEntry[]> {
    const answer = await this.journals.put(question)
    if ('code' in answer) throw new MosaicError(answer.code, answer.message)
    return answer
  }

  /** Asked again while the robot thinks, the same answer serves. */
  clear(): Promise<ClearReport> {
    this.clearing ??= this.askToClear().finally(() => (this.clearing = null))
    return this.clearing
  }

  journalHeard(entries: readonly JournalEntry[]): void {
    this.journals.answer(entries)
  }

  stopCleared(): void {
    this.clears.answer(true)
  }

  /**
   * A refusal on the control channel does not name the question; only the journal asks for a permission. True if it
   * answered one.
   */
  refused(refusal: Refusal): boolean {
    const isOfJournal = !this.journals.isEmpty && (this.clears.isEmpty || refusal.code === 'auth.forbidden')
    if (!isOfJournal && this.clears.isEmpty) return false
    if (isOfJournal) this.journals.answer(whyOf(refusal))
    else this.clears.answer(whyOf(refusal))
    return true
  }

  linkLost(): void {
    this.journals.answerAll({ code: 'peer.lost' })
    this.clears.answerAll({ code: 'peer.lost' })
  }

  private async askToClear(): Promise<ClearReport> {
    const answer = await this.clears.put(null)
    return answer === true ? { isCleared: true } : { isCleared: false, ...answer }
  }
}
