import { encodeFrame, PayloadKind, type ControlMessages, type LeaseReply, type LeaseState, type PeerInfo } from '@mosaic/protocol'
import fc from 'fast-check'
import { describe, expect, test } from 'vitest'
import type { LeaseEffect } from '../../src/control/leaseEntry'
import { HIDDEN_GRACE_MS, LeaseTable, RECLAIM_WITHIN_MS, type LeaseEvent } from '../../src/control/leaseTable'
import { FakeRobot } from '../fakeRobot'
import type { FakePeerConnection } from '../fakes'

const ME = 'me'
const person = (peerId: string): PeerInfo => ({ peerId, name: peerId, role: 'operator', isPerson: true, isOriginal: false })
const waiting = (peerId: string) => ({ peerId, name: peerId, reason: '', isPerson: true })

/** A page that has met the robot, and a clock that the test moves. */
class Page {
  readonly table = new LeaseTable()
  nowMs = 1000
  readonly said: { message: string; data: unknown }[] = []
  readonly told: unknown[] = []

  constructor(me: string | null = ME) {
    this.table.me = me
  }

  give(event: LeaseEvent): this {
    for (const effect of this.table.handle(event, this.nowMs)) this.note(effect)
    return this
  }

  /** Time passes with the ticks of the page's clock. */
  passes(ms: number): this {
    for (const endMs = this.nowMs + ms; this.nowMs < endMs; ) {
      this.nowMs += Math.min(500, endMs - this.nowMs)
      this.give({ type: 'ticked' })
    }
    return this
  }

  asks(resource = 'motion'): this {
    return this.give({ type: 'requested', resource, reason: '', force: false })
  }

  reply(outcome: LeaseReply['outcome'], more: Partial<LeaseReply> = {}): this {
    return this.give({ type: 'replied', reply: { resource: 'motion', outcome, epoch: 0, code: '', ...more } })
  }

  state(more: Partial<LeaseState> = {}): this {
    return this.give({ type: 'stateHeard', state: { resource: 'motion', epoch: 0, queue: [], expiryS: 2, ...more } })
  }

  holds(epoch = 7): this {
    return this.asks().state({ holder: person(ME), epoch }).reply('granted', { epoch })
  }

  get epoch(): number {
    return this.table.epochOf('motion', this.nowMs)
  }

  get view() {
    return this.table.view('motion')
  }

  private note(effect: LeaseEffect): void {
    if (effect.type === 'tell') return void this.told.push(effect.event)
    this.said.push({ message: effect.message, data: effect.data })
    if (effect.message === 'lease.keep') this.table.kept(this.nowMs)
  }
}

describe('asking', () => {
  test('says so to the robot and shows that an answer is awaited', () => {
    const page = new Page().give({ type: 'requested', resource: 'arm', reason: 'mine', force: true })
    expect(page.said).toEqual([{ message: 'lease.request', data: { resource: 'arm', reason: 'mine', force: true } }])
    expect(page.table.view('arm').request).toEqual({ phase: 'asked', code: '', place: 0 })
    expect(page.table.epochOf('arm', page.nowMs)).toBe(0)
  })

  test('and being granted makes the lease mine, with its epoch', () => {
    const page = new Page().holds(7)
    expect(page.view).toMatchObject({ state: 'mine', isMine: true, epoch: 7, request: null, holder: { peerId: ME, isMe: true } })
    expect(page.epoch).toBe(7)
    expect(page.told).toEqual([{ type: 'granted', resource: 'motion' }])
  })

  test('again for what is mine is no news', () => {
    const page = new Page().holds(7).asks().reply('granted', { epoch: 7 })
    expect(page.told).toHaveLength(1)
    expect(page.epoch).toBe(7)
  })

  test('a robot that says who holds it before it says granted has granted nothing yet', () => {
    const page = new Page().asks().state({ holder: person(ME), epoch: 7 })
    expect(page.epoch).toBe(0)
    expect(page.view.state).toBe('free')
  })

  test('shows the place in the queue, and why it takes so long', () => {
    const page = new Page().asks().reply('queued', { code: 'lease.queued', message: 'wait' })
    page.state({ holder: person('ada'), epoch: 3, queue: [waiting('eve'), waiting(ME)] })
    expect(page.view).toMatchObject({ state: 'other', holder: { peerId: 'ada', isMe: false } })
    expect(page.view.request).toEqual({ phase: 'queued', place: 2, code: 'lease.queued', message: 'wait' })
    expect(page.told).toEqual([{ type: 'queued', resource: 'motion', code: 'lease.queued', message: 'wait' }])
  })

  test('may be denied, with the reason', () => {
    const page = new Page().asks().reply('denied', { code: 'lease.denied', message: 'not now' })
    expect(page.view).toMatchObject({ request: null, ended: { code: 'lease.denied', message: 'not now' } })
    expect(page.told).toEqual([{ type: 'denied', resource: 'motion', code: 'lease.denied', message: 'not now' }])
  })

  test('may not even be considered', () => {
    const page = new Page().holds().asks('arm').give({ type: 'refused', why: { code: 'signal.too_slow' } })
    expect(page.table.view('arm')).toMatchObject({ request: null, ended: { code: 'signal.too_slow' } })
    expect(page.told.at(-1)).toEqual({ type: 'denied', resource: 'arm', code: 'signal.too_slow' })
    expect(page.epoch).toBe(7)
  })

  test('is forgotten when the robot has forgotten it', () => {
    const page = new Page().asks().reply('queued', { code: 'lease.queued' })
    page.state({ holder: person('ada'), epoch: 3, queue: [waiting(ME)] }).state({ holder: person('ada'), epoch: 3 })
    expect(page.view.request).toBeNull()
  })

  test('lasts from the queue to the grant although the robot tells the new holder first', () => {
    const page = new Page().asks().reply('queued', { code: 'lease.queued' })
    page.state({ holder: person('ada'), epoch: 3, queue: [waiting(ME)] })
    page.state({ holder: person(ME), epoch: 4 }).reply('granted', { epoch: 4 })
    expect(page.epoch).toBe(4)
  })

  test('a grant of epoch 0 is none', () => {
    expect(new Page().asks().reply('granted', { epoch: 0 }).view.isMine).toBe(false)
  })

  test('a grant that nobody asked for is none', () => {
    expect(new Page().reply('granted', { epoch: 5 }).view.isMine).toBe(false)
  })

  test('clears what was said of the last time', () => {
    expect(new Page().asks().reply('denied', { code: 'lease.denied' }).asks().view.ended).toBeNull()
  })
})

describe('giving back', () => {
  test('ends it at once, before the robot has heard of it', () => {
    const page = new Page().holds().give({ type: 'released', resource: 'motion' })
    expect(page.said.at(-1)).toEqual({ message: 'lease.release', data: { resource: 'motion' } })
    expect(page.epoch).toBe(0)
    page.state({ holder: person(ME), epoch: 7, queue: [waiting('eve')] })
    expect(page.epoch).toBe(0)
  })

  test('is no loss', () => {
    const page = new Page().holds().give({ type: 'released', resource: 'motion' }).reply('ended', { code: 'lease.released' })
    expect(page.told).toEqual([{ type: 'granted', resource: 'motion' }])
    expect(page.view.ended).toBeNull()
  })

  test('a request that is granted meanwhile is not taken', () => {
    const page = new Page().asks().give({ type: 'released', resource: 'motion' }).reply('granted', { epoch: 9 })
    expect(page.epoch).toBe(0)
    expect(page.view.state).toBe('free')
  })

  test('and asking at once again takes the second answer, not the first', () => {
    const page = new Page().asks().give({ type: 'released', resource: 'motion' }).asks()
    page.state({ holder: person(ME), epoch: 9 }).reply('granted', { epoch: 9 })
    expect(page.epoch).toBe(0)
    page.reply('ended', { code: 'lease.released' }).state()
    page.state({ holder: person(ME), epoch: 10 }).reply('granted', { epoch: 10 })
    expect(page.epoch).toBe(10)
    expect(page.told).toEqual([{ type: 'granted', resource: 'motion' }])
  })

  test('to a robot that never confirms it does not make the page deaf', () => {
    const page = new Page().holds().give({ type: 'released', resource: 'motion' })
    page.nowMs += 2000
    expect(page.asks().reply('granted', { epoch: 9 }).epoch).toBe(9)
  })
})

describe('a lease that is mine', () => {
  test('is kept alive every tick, all in one message', () => {
    const page = new Page().holds(7).asks('arm').give({
      type: 'replied',
      reply: { resource: 'arm', outcome: 'granted', epoch: 8, code: '' },
    })
    page.said.length = 0
    page.passes(1000)
    expect(page.said).toEqual([
      { message: 'lease.keep', data: { epochs: { motion: 7, arm: 8 } } },
      { message: 'lease.keep', data: { epochs: { motion: 7, arm: 8 } } },
    ])
  })

  test.each(['lease.taken_over', 'lease.preempted', 'lease.expired', 'lease.handed_over', 'lease.peer_left'])(
    'ends by the word of the robot: %s',
    (code) => {
      const page = new Page().holds().reply('ended', { code, message: 'why' })
      expect(page.epoch).toBe(0)
      page.state({ holder: person('eve'), epoch: 8 })
      expect(page.view).toMatchObject({ state: 'other', ended: { code, message: 'why' } })
      expect(page.told.at(-1)).toEqual({ type: 'lost', resource: 'motion', code, message: 'why' })
      expect(page.told).toHaveLength(2)
    },
  )

  test('ends by the sight of another holder, and the reason that follows is told', () => {
    const page = new Page().holds().state({ holder: person('eve'), epoch: 8 })
    expect(page.epoch).toBe(0)
    expect(page.view.ended).toEqual({ code: 'lease.not_holder' })
    page.reply('ended', { code: 'lease.taken_over' })
    expect(page.view.ended).toEqual({ code: 'lease.taken_over' })
    expect(page.told.at(-1)).toEqual({ type: 'lost', resource: 'motion', code: 'lease.taken_over' })
  })

  test('tells each asker once', () => {
    const page = new Page().holds(7)
    page.state({ holder: person(ME), epoch: 7, queue: [waiting('eve')] })
    page.state({ holder: person(ME), epoch: 7, queue: [waiting('eve'), waiting('bob')] })
    expect(page.told.slice(1)).toEqual([
      { type: 'asked', resource: 'motion', by: waiting('eve') },
      { type: 'asked', resource: 'motion', by: waiting('bob') },
    ])
  })

  test('tells an asker who left and came again', () => {
    const page = new Page().holds(7)
    for (const queue of [[waiting('eve')], [], [waiting('eve')]]) page.state({ holder: person(ME), epoch: 7, queue })
    expect(page.told.filter((event) => (event as { type: string }).type === 'asked')).toHaveLength(2)
  })

  test('says nothing of who waits for somebody else\'s', () => {
    const page = new Page().state({ holder: person('ada'), epoch: 3, queue: [waiting('eve')] })
    expect(page.told).toEqual([])
  })
})

describe('a page that slept', () => {
  test('sends nothing under the old epoch, even before it has ticked', () => {
    const page = new Page().holds()
    page.nowMs += 2001
    expect(page.epoch).toBe(0)
    page.said.length = 0
    page.give({ type: 'ticked' })
    expect(page.said).toEqual([])
    expect(page.view).toMatchObject({ isMine: false, ended: { code: 'lease.expired' } })
    page.reply('ended', { code: 'lease.expired' })
    expect(page.told.slice(1)).toEqual([{ type: 'lost', resource: 'motion', code: 'lease.expired' }])
  })

  test('goes by the expiry that the robot told', () => {
    const page = new Page().asks().state({ holder: person(ME), epoch: 7, expiryS: 0.6 }).reply('granted', { epoch: 7 })
    page.nowMs += 601
    expect(page.epoch).toBe(0)
  })

  test('counts only keep-alives that left', () => {
    const page = new Page().holds()
    for (let tick = 0; tick < 5; tick += 1) {
      page.nowMs += 500
      page.table.handle({ type: 'ticked' }, page.nowMs)
    }
    expect(page.epoch).toBe(0)
  })

  test('does so on a clock that stood still, too, whatever it said since', () => {
    const page = new Page().holds()
    page.give({ type: 'ticked' })
    page.table.kept(page.nowMs)
    page.said.length = 0
    page.give({ type: 'slept', ms: 60_000 })
    expect(page.epoch).toBe(0)
    expect(page.said).toEqual([])
    expect(page.told.at(-1)).toEqual({ type: 'lost', resource: 'motion', code: 'lease.expired' })
  })

  test('asks for nothing again that it lost before it fell asleep', () => {
    const page = new Page().holds().give({ type: 'linkLost', onPurpose: false })
    page.give({ type: 'slept', ms: RECLAIM_WITHIN_MS })
    page.table.me = 'me-2'
    page.said.length = 0
    page.state()
    expect(page.said).toEqual([])
    expect(page.told.at(-1)).toEqual({ type: 'lost', resource: 'motion', code: 'lease.expired' })
  })

  test('and whose link ended meanwhile does not ask again', () => {
    const page = new Page().holds()
    page.nowMs += 2001
    page.give({ type: 'linkLost', onPurpose: false })
    page.table.me = 'me-2'
    page.said.length = 0
    page.state()
    expect(page.said).toEqual([])
    expect(page.told.at(-1)).toEqual({ type: 'lost', resource: 'motion', code: 'lease.expired' })
  })
})

describe('a hidden page', () => {
  const hide: LeaseEvent = { type: 'visibilityChanged', isVisible: false }

  test('keeps its leases for a glance at another tab', () => {
    const page = new Page().holds().give(hide).passes(HIDDEN_GRACE_MS - 500)
    page.give({ type: 'visibilityChanged', isVisible: true }).passes(60_000)
    expect(page.epoch).toBe(7)
  })

  test('gives them back after that, and says so', () => {
    const page = new Page().holds().give(hide).give(hide).passes(HIDDEN_GRACE_MS)
    expect(page.said.at(-1)).toEqual({ message: 'lease.release', data: { resource: 'motion' } })
    expect(page.epoch).toBe(0)
    expect(page.told.at(-1)).toMatchObject({ type: 'lost', code: 'lease.released' })
    expect(page.view.ended).toMatchObject({ code: 'lease.released', message: 'the page was hidden for 10 s' })
  })

  test('waits in no queue either', () => {
    const page = new Page().asks().reply('queued', { code: 'lease.queued' }).give(hide).passes(HIDDEN_GRACE_MS)
    expect(page.view.request).toBeNull()
    expect(page.said.at(-1)?.message).toBe('lease.release')
  })
})

describe('a lost link', () => {
  const lost: LeaseEvent = { type: 'linkLost', onPurpose: false }
  const back = (page: Page, me = 'me-2'): Page => {
    page.table.me = me
    page.said.length = 0
    return page
  }

  test('takes the epoch at once', () => {
    const page = new Page().holds().give(lost)
    expect(page.epoch).toBe(0)
    expect(page.view).toMatchObject({ state: 'free', holder: null })
  })

  test.each([
    ['free', {}],
    ['still held by my old peer', { holder: person(ME), epoch: 7 }],
    ['already moved to my new peer', { holder: person('me-2'), epoch: 7 }],
  ])('that is back in time asks again for what is %s', (_, state) => {
    const page = back(new Page().holds().give(lost).passes(3000)).state(state)
    expect(page.said).toEqual([{ message: 'lease.request', data: { resource: 'motion', reason: '', force: false } }])
    expect(page.epoch).toBe(0)
    page.state({ holder: person('me-2'), epoch: 9 }).reply('granted', { epoch: 9 })
    expect(page.epoch).toBe(9)
    expect(page.said.filter(({ message }) => message === 'lease.request')).toHaveLength(1)
  })

  test('bothers nobody who holds it by now', () => {
    const page = back(new Page().holds().give(lost)).state({ holder: person('eve'), epoch: 8 })
    expect(page.said).toEqual([])
    expect(page.told.at(-1)).toEqual({ type: 'lost', resource: 'motion', code: 'lease.expired' })
    expect(page.table.needsTicks).toBe(false)
  })

  test('leaves the queue that it was put into because somebody was faster', () => {
    const page = back(new Page().holds().give(lost)).state().reply('queued', { code: 'lease.queued' })
    expect(page.said.at(-1)).toEqual({ message: 'lease.release', data: { resource: 'motion' } })
    expect(page.told.at(-1)).toMatchObject({ type: 'lost', code: 'lease.expired' })
  })

  test('takes a denial as the end', () => {
    const page = back(new Page().holds().give(lost)).state().reply('denied', { code: 'lease.forbidden' })
    expect(page.said).toHaveLength(1)
    expect(page.told.at(-1)).toMatchObject({ type: 'lost', code: 'lease.expired' })
    expect(page.view.request).toBeNull()
  })

  test('survives losing the link again while it asks', () => {
    const page = back(new Page().holds().give(lost)).state().give(lost)
    back(page, 'me-3').state()
    expect(page.said).toHaveLength(1)
    expect(page.state({ holder: person('me-3'), epoch: 9 }).reply('granted', { epoch: 9 }).epoch).toBe(9)
  })

  test('that lasts too long is the end of it', () => {
    const page = new Page().holds().give(lost).passes(RECLAIM_WITHIN_MS)
    expect(page.told.at(-1)).toEqual({ type: 'lost', resource: 'motion', code: 'lease.expired' })
    expect(back(page).state().said).toEqual([])
  })

  test('that never comes back is told with its reason', () => {
    const page = new Page().holds().give(lost).give({ type: 'gaveUp', why: { code: 'peer.replaced' } })
    expect(page.told.at(-1)).toEqual({ type: 'lost', resource: 'motion', code: 'peer.replaced' })
  })

  test('on purpose is no loss, and nothing is asked for again', () => {
    const page = new Page().holds().give({ type: 'linkLost', onPurpose: true })
    expect(page.told).toHaveLength(1)
    expect(back(page).state().said).toEqual([])
    expect(page.table.needsTicks).toBe(false)
  })

  test('ends a request, which a person may make again', () => {
    const page = new Page().asks().reply('queued', { code: 'lease.queued' }).give(lost)
    expect(page.view).toMatchObject({ request: null, ended: { code: 'peer.lost' } })
    expect(back(page).state().said).toEqual([])
  })

  test('takes what was not confirmed along: the new link answers what is asked on it', () => {
    const page = new Page().holds().give({ type: 'released', resource: 'motion' }).give(lost)
    back(page).state().asks().reply('granted', { epoch: 9 })
    expect(page.epoch).toBe(9)
  })

  test('releasing in the meantime forgets the wish', () => {
    const page = new Page().holds().give(lost).give({ type: 'released', resource: 'motion' })
    expect(back(page).state().said).toEqual([])
  })
})

// -- properties ------------------------------------------------------------------------------------------------------

const epochs = fc.integer({ min: 0, max: 5 })
const holders = fc.constantFrom<PeerInfo | undefined>(undefined, person(ME), person('eve'))
const events = fc.oneof(
  fc.constant<LeaseEvent>({ type: 'requested', resource: 'motion', reason: '', force: false }),
  fc.constant<LeaseEvent>({ type: 'released', resource: 'motion' }),
  fc.record({
    type: fc.constant('replied' as const),
    reply: fc.record({
      resource: fc.constant('motion'),
      outcome: fc.constantFrom<LeaseReply['outcome']>('granted', 'queued', 'denied', 'ended'),
      epoch: epochs,
      code: fc.constantFrom('', 'lease.expired', 'lease.released', 'lease.taken_over'),
    }),
  }),
  fc.tuple(epochs, holders, fc.boolean()).map(
    ([epoch, holder, isWaiting]): LeaseEvent => ({
      type: 'stateHeard',
      state: { resource: 'motion', epoch, expiryS: 2, queue: isWaiting ? [waiting(ME)] : [], ...(holder ? { holder } : {}) },
    }),
  ),
  fc.constant<LeaseEvent>({ type: 'ticked' }),
  fc.constant<LeaseEvent>({ type: 'refused', why: { code: 'signal.too_slow' } }),
  fc.boolean().map((isVisible): LeaseEvent => ({ type: 'visibilityChanged', isVisible })),
  fc.boolean().map((onPurpose): LeaseEvent => ({ type: 'linkLost', onPurpose })),
)

/** Whether what the page heard last leaves it the right to command at all. */
function endsIt(event: LeaseEvent): boolean {
  switch (event.type) {
    case 'released':
    case 'linkLost':
      return true
    case 'replied':
      return event.reply.outcome === 'ended'
    case 'stateHeard':
      return event.state.holder?.peerId !== ME
    default:
      return false
  }
}

test('an epoch is never used after any sign that it has ended, nor in silence, whatever happens', () => {
  fc.assert(
    fc.property(fc.array(fc.tuple(events, fc.integer({ min: 0, max: 2500 }))), (steps) => {
      const page = new Page()
      let granted: LeaseEvent | null = null
      for (const [event, ms] of steps) {
        page.nowMs += ms
        page.give(event)
        page.table.me = ME
        if (endsIt(event)) granted = null
        if (event.type === 'replied' && event.reply.outcome === 'granted') granted = event
        if (page.epoch > 0) expect(granted).not.toBeNull()
        expect(page.table.epochOf('motion', page.nowMs + 2001)).toBe(0)
      }
    }),
    { numRuns: 1000 },
  )
})

test('whatever the robot says, the views stay consistent', () => {
  fc.assert(
    fc.property(fc.array(events), (steps) => {
      const page = new Page()
      for (const event of steps) {
        const { view } = page.give(event)
        expect(view.isMine).toBe(view.state === 'mine')
        expect(view.isMine).toBe(view.epoch > 0)
        if (view.request) expect(['asked', 'queued']).toContain(view.request.phase)
        expect(page.table.needsTicks || !view.isMine).toBe(true)
      }
    }),
  )
})

/** One operator on a path whose messages wait until the test lets them through, in order each way. */
class SlowOperator {
  readonly page: Page
  private readonly up: (() => void)[] = []
  private readonly down: (() => void)[] = []
  private seq = 0

  constructor(
    readonly name: string,
    robot: FakeRobot,
  ) {
    this.page = new Page(null)
    const channel = {
      label: '_mosaic',
      onsent: null as ((data: Uint8Array) => void) | null,
      control: <T extends keyof ControlMessages>(type: T, data: ControlMessages[T]) =>
        void this.down.push(() => this.hear(type, data)),
    }
    const stop = { label: '_stop', onsent: null }
    const peer = { channel: (label: string) => (label === '_stop' ? stop : channel) } as unknown as FakePeerConnection
    robot.greets(peer, { peerId: name })
    this.send = (text) => {
      this.seq += 1
      const frame = { kind: PayloadKind.JSON, payload: new TextEncoder().encode(text), seq: this.seq, epoch: 0, stampUs: 0, latched: false }
      const [bytes] = encodeFrame(frame)
      if (bytes) this.up.push(() => channel.onsent?.(bytes))
    }
  }

  private readonly send: (text: string) => void

  does(event: LeaseEvent): void {
    const before = this.page.said.length
    this.page.give(event)
    for (const { message, data } of this.page.said.slice(before)) this.send(JSON.stringify({ type: message, data }))
  }

  answers(peerId: string, grant: boolean): void {
    this.send(JSON.stringify({ type: 'lease.answer', data: { resource: 'motion', peerId, grant, message: '' } }))
  }

  lets(way: 'up' | 'down'): boolean {
    const next = this[way].shift()
    next?.()
    return next !== undefined
  }

  private hear<T extends keyof ControlMessages>(type: T, data: ControlMessages[T]): void {
    if (type === 'peers') this.page.table.me = (data as ControlMessages['peers']).you
    if (type === 'lease.state') this.does({ type: 'stateHeard', state: data as LeaseState })
    if (type === 'lease.reply') this.does({ type: 'replied', reply: data as LeaseReply })
  }
}

type Step = 'asks' | 'releases' | 'grants' | 'refuses' | 'up' | 'down'

test('two operators on slow paths agree with the robot as soon as all has been said', () => {
  const who = fc.constantFrom(0, 1)
  const steps = fc.oneof(
    fc.record({ who, does: fc.constantFrom<Step>('asks', 'releases', 'grants', 'refuses', 'up', 'down') }),
    fc.record({ who, does: fc.constant<Step>('up') }),
    fc.record({ who, does: fc.constant<Step>('down') }),
  )
  fc.assert(
    fc.property(fc.array(steps, { maxLength: 60 }), (walk) => {
      const robot = new FakeRobot()
      const operators = [new SlowOperator('ada', robot), new SlowOperator('eve', robot)] as const
      for (const step of walk) {
        const [operator, other] = step.who === 0 ? operators : [operators[1], operators[0]]
        if (step.does === 'asks') operator.does({ type: 'requested', resource: 'motion', reason: '', force: false })
        else if (step.does === 'releases') operator.does({ type: 'released', resource: 'motion' })
        else if (step.does === 'grants') operator.answers(other.name, true)
        else if (step.does === 'refuses') operator.answers(other.name, false)
        else operator.lets(step.does)
        for (const { name, page } of operators) {
          // Never ahead of the robot: an epoch here was granted to this very operator.
          if (page.epoch > 0 && page.epoch === robot.epochOf()) expect(robot.holder()).toBe(name)
        }
      }
      let isMoving = true
      while (isMoving) isMoving = operators.some((operator) => operator.lets('up') || operator.lets('down'))
      for (const { name, page } of operators) {
        expect(page.epoch).toBe(robot.holder() === name ? robot.epochOf() : 0)
        expect(page.view.state).toBe(robot.holder() === null ? 'free' : robot.holder() === name ? 'mine' : 'other')
      }
    }),
    { numRuns: 500 },
  )
})
