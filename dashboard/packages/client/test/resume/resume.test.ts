import fc from 'fast-check'
import { readFileSync } from 'node:fs'
import { describe, expect, test } from 'vitest'
import { ResumeReceiver } from '../../src/resume/ResumeReceiver'
import { ResumeSender, type Numbered } from '../../src/resume/ResumeSender'

interface Step {
  do: string
  with: unknown[]
  gives: unknown
  then: Record<string, number | null>
}

interface Golden {
  limits: { messages: number; size_bytes: number; age_s: number; in_flight_messages: number; in_flight_bytes: number }
  senders: { name: string; steps: Step[] }[]
  receivers: { name: string; received: number | null; steps: Step[] }[]
}

const GOLDEN = JSON.parse(readFileSync(new URL('../../../../../tests/wire/resume.json', import.meta.url), 'utf8')) as Golden
const LIMITS = {
  messages: GOLDEN.limits.messages,
  sizeBytes: GOLDEN.limits.size_bytes,
  ageMs: GOLDEN.limits.age_s * 1000,
  inFlightMessages: GOLDEN.limits.in_flight_messages,
  inFlightBytes: GOLDEN.limits.in_flight_bytes,
}

function sent<T>(sender: ResumeSender<T>): Numbered<T> | null {
  const message = sender.upcoming()
  if (message !== null) sender.wentOut()
  return message
}

function doneBySender(sender: ResumeSender<string>, step: Step): unknown {
  const [first, second, third] = step.with
  switch (step.do) {
    case 'accept':
      return sender.accept(first as string, second as number, (third as number) * 1000)
    case 'send': {
      const message = sent(sender)
      return message === null ? null : [message.seq, message.item, message.isRepeated]
    }
    case 'resumed':
      return sender.resumed(first as number | null)
    case 'delivered':
      sender.delivered(first as number)
      return null
    case 'detached':
      sender.detached()
      return null
    default:
      return sender.abandoned()
  }
}

function doneByReceiver(receiver: ResumeReceiver, step: Step): unknown {
  const [first] = step.with
  switch (step.do) {
    case 'arrived': {
      const { isNew, lost } = receiver.arrived(first as number)
      return [isNew, lost]
    }
    case 'announced':
      return receiver.announced(first as number | null)
    case 'untold':
      return receiver.untold()
    default:
      receiver.renewed()
      return null
  }
}

describe('the golden steps', () => {
  test.each(GOLDEN.senders)('a sender: $name', ({ steps }) => {
    const sender = new ResumeSender<string>(LIMITS)
    for (const step of steps) {
      expect(doneBySender(sender, step)).toEqual(step.gives)
      expect({
        first_seq: sender.firstSeq,
        next_seq: sender.nextSeq,
        waiting: sender.waiting,
        unconfirmed: sender.unconfirmed,
        size_bytes: sender.sizeBytes,
        lost: sender.lost,
        resent: sender.resent,
      }).toEqual(step.then)
    }
  })

  test.each(GOLDEN.receivers)('a receiver: $name', ({ received, steps }) => {
    const receiver = new ResumeReceiver(received)
    for (const step of steps) {
      expect(doneByReceiver(receiver, step)).toEqual(step.gives)
      expect({ received: receiver.received, lost: receiver.lost }).toEqual(step.then)
    }
  })
})

const STEPS = ['send', 'send', 'put', 'put', 'deliver', 'deliver', 'tell', 'hear', 'lose', 'connect', 'halfConnect', 'wait'] as const

/** A sender and a receiver with a connection between them that comes and goes; everything on it is ordered. */
class World {
  readonly sender = new ResumeSender<number>(LIMITS)
  readonly arrived: number[] = []
  accepted = 0
  private wire: Numbered<number>[] = []
  private told: number[] = []
  private nowMs = 0

  constructor(
    readonly receiver: ResumeReceiver,
    private readonly senderSpeaksFirst: boolean,
  ) {
    this.connect()
  }

  send(): void {
    if (this.sender.accept(this.accepted, 1 + (this.accepted % 7), this.nowMs)) this.accepted += 1
  }

  put(): void {
    const message = sent(this.sender)
    if (message) this.wire.push(message)
  }

  deliver(): void {
    const message = this.wire.shift()
    if (message && this.receiver.arrived(message.seq).isNew) this.arrived.push(message.item)
  }

  tell(): void {
    const seq = this.receiver.untold()
    if (seq !== null && this.sender.isAttached) this.told.push(seq)
  }

  hear(): void {
    const seq = this.told.shift()
    if (seq !== undefined) this.sender.delivered(seq)
  }

  lose(): void {
    this.wire = []
    this.told = []
    this.sender.detached()
  }

  connect(): void {
    if (this.sender.isAttached) return
    if (this.senderSpeaksFirst) this.receiver.announced(this.sender.firstSeq)
    this.sender.resumed(this.receiver.received)
    if (!this.senderSpeaksFirst) this.receiver.announced(this.sender.firstSeq)
  }

  /** The connection is lost again before the other side's word has arrived. */
  halfConnect(): void {
    if (this.sender.isAttached) return
    if (this.senderSpeaksFirst) this.receiver.announced(this.sender.firstSeq)
    else this.sender.resumed(this.receiver.received)
    this.lose()
  }

  wait(): void {
    this.nowMs += 6000
  }

  settle(): void {
    this.lose()
    this.connect()
    while (this.sender.upcoming() !== null) this.put()
    for (let left = this.accepted + 1; left > 0; left--) this.deliver()
  }
}

test('every accepted message arrives once and in order, or both ends count it', () => {
  const start = fc.constantFrom<[number, boolean]>([0, true], [0, false], [2 ** 32 - 4, false])
  fc.assert(
    fc.property(fc.array(fc.constantFrom(...STEPS), { maxLength: 120 }), start, (steps, [received, speaksFirst]) => {
      const world = new World(new ResumeReceiver(received), speaksFirst)
      for (const step of steps) {
        world[step]()
        expect(world.sender.unconfirmed).toBeLessThanOrEqual(LIMITS.messages + LIMITS.inFlightMessages)
        expect(world.sender.sizeBytes).toBeLessThanOrEqual(LIMITS.sizeBytes + LIMITS.inFlightBytes)
      }
      world.settle()
      expect(world.arrived).toEqual([...new Set(world.arrived)].sort((a, b) => a - b))
      expect(world.arrived.length + world.receiver.lost).toBe(world.accepted)
      expect(world.sender.lost).toBe(world.receiver.lost)
      if (!steps.includes('wait')) expect(world.sender.lost).toBe(0) // only what waited too long may be lost
    }),
  )
})
