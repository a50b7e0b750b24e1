import type { SafetyLimit, StopReport } from '@mosaic/client'
import { describe, expect, test } from 'vitest'
import { ALICE, ALICES, FREE, ME, MINE, PATROL, SAFE, SENDING } from '../../test/fakeRobot'
import { noticeOf } from './controlNews'
import { clearing, leaseText, limitText, nameOf, refusalText, sinceText, stopReportText, whyText } from './controlText'
import { presenceSentence, presentOf } from './presence'

describe('a stop', () => {
  test.each<[Partial<StopReport>, string]>([
    [{}, 'Stopping…'],
    [{ phase: 'safe', safeMs: 43.2, acknowledgedMs: 21 }, 'Stopped in 43 ms'],
    [{ phase: 'safe', acknowledgedMs: 8.26 }, 'Stopped, confirmed after 8.3 ms'],
    [{ phase: 'acknowledged', acknowledgedMs: 21 }, 'The robot has your stop after 21 ms; its safe action is still running'],
    [{ copies: 0 }, 'Not stopped: this page is not connected, so nothing was sent yet'],
    [{ phase: 'unconfirmed', copies: 0 }, 'Not stopped: this page is not connected, so nothing was sent'],
    [{ phase: 'unconfirmed' }, 'The robot did not confirm the stop'],
    [{ phase: 'unavailable' }, 'Not stopped: this robot knows no stop, and no drive of it is known here: nothing was sent'],
    [{ phase: 'unavailable', zeros: { sent: [], unsent: ['cmd_vel'] } }, 'Not stopped: this robot knows no stop; nothing was sent to ‘cmd_vel’, whose channel is not open'],
    [{ phase: 'unavailable', zeros: { sent: ['cmd_vel'], unsent: [] } }, 'This robot knows no stop; zeros were sent to ‘cmd_vel’'],
    [{ phase: 'unavailable', zeros: { sent: ['base'], unsent: ['arm'] } }, 'This robot knows no stop; zeros were sent to ‘base’; nothing was sent to ‘arm’, whose channel is not open'],
  ])('%j reads “%s”', (change, text) => expect(stopReportText({ ...SENDING, ...change })).toBe(text))

  test('a measured time never hides that the robot only has it', () => {
    expect(stopReportText({ ...SAFE, phase: 'acknowledged' })).toContain('still running')
  })
})

test('when it was stopped is said to the second, and how long ago by the minute', () => {
  expect(sinceText(null, 0)).toBe('')
  expect(sinceText(0, 59_000)).toMatch(/^Since \d[^,]*$/)
  expect(sinceText(0, 150_000)).toMatch(/, for 2 min$/)
  expect(sinceText(0, 3 * 3_600_000)).toMatch(/, for 3 h$/)
  expect(sinceText(5000, 0)).not.toContain('min')
})

describe('clearing', () => {
  test.each([
    ['the holder may', ME, MINE, true],
    ['a supervisor may', { ...ME, role: 'supervisor' as const }, ALICES, true],
    ['somebody else may not', ME, ALICES, false],
    ['nobody who has no control may', ME, FREE, false],
  ])('%s', (_name, me, lease, mayClear) => expect(clearing(me, { motion: lease }).mayClear).toBe(mayClear))

  test('who may not is told who may', () => {
    expect(clearing(ME, { motion: ALICES }).text).toContain('Alice')
    expect(clearing(ME, { motion: FREE }).text).toContain('Take control')
    expect(clearing({ ...ME, role: 'observer' }, { motion: FREE }).text).toContain('supervisor')
    expect(clearing(null, {}).mayClear).toBe(false)
  })
})

describe('a limit', () => {
  const limit = (factor: number, ...causes: SafetyLimit['causes']): SafetyLimit => ({ label: 'cmd_vel', factor, causes })

  test('that limits nothing says nothing', () => {
    expect(limitText(null)).toBeNull()
    expect(limitText(limit(1, { cause: 'rtt', value: 12, factor: 1 }))).toBeNull()
  })

  test('names its causes, the worst first', () => {
    const text = limitText(limit(0.2, { cause: 'rtt', value: 400, factor: 0.5 }, { cause: 'loss', value: 0.5, factor: 0.2 }, { cause: 'picture', value: 90, factor: 1 }))
    expect(text?.title).toBe('Slowed to 20 %')
    expect(text?.why).toBe('the link loses commands (50 %); the link is slow (round trip 400 ms)')
  })

  test('of zero holds the robot', () => {
    expect(limitText(limit(0, { cause: 'picture', value: 1200, factor: 0 }))).toMatchObject({ tone: 'held', why: 'the picture is old (1.2 s)' })
    expect(limitText(limit(0, { cause: 'picture', factor: 0 }))?.why).toBe('no picture is shown')
  })
})

describe('the lease button', () => {
  test.each([
    ['free', FREE, ME, 'Take control', 'take'],
    ['mine', MINE, ME, 'You have control', 'release'],
    ['Alice’s', ALICES, ME, 'Alice has control', 'ask'],
    ['asked for', { ...FREE, request: { phase: 'asked' as const, place: 0, code: '' } }, ME, 'Asking…', 'withdraw'],
    ['waited for', { ...ALICES, request: { phase: 'queued' as const, place: 1, code: 'lease.queued' } }, ME, 'Waiting for Alice', 'withdraw'],
    ['an observer’s', FREE, { ...ME, role: 'observer' as const }, 'Observing', null],
  ])('of a lease that is %s', (_name, lease, me, label, action) => expect(leaseText(lease, me)).toMatchObject({ label, action }))

  test('says the place in the queue', () => {
    expect(leaseText({ ...ALICES, request: { phase: 'queued', place: 3, code: '' } }, ME).hint).toContain('number 3')
  })
})

test.each([
  [null, 'Nobody'],
  [ME, 'You'],
  [ALICE, 'Alice'],
  [{ ...ALICE, name: '', isOriginal: true }, 'An original dashboard'],
  [{ ...PATROL, name: '' }, 'A program'],
  [{ ...ALICE, name: '' }, 'Somebody'],
])('%j is called %s', (peer, name) => expect(nameOf(peer)).toBe(name))

test('a refusal names its gate, why, what to do, and how many it speaks for', () => {
  const bare = { label: 'cmd_vel', code: 'safety.too_fast' }
  expect(refusalText(bare)).toBe('Refused: Commands came faster than this connector takes them. Send no faster than `max_rate_hz` of the connector.')
  const invalid = { ...bare, code: 'channel.invalid' }
  expect(refusalText({ ...invalid, message: "no field 'linera': did you mean 'linear'?" })).toContain("'linear'? Compare it with")
  expect(refusalText({ ...invalid, message: 'rpm: Field required' })).toContain('Field required. Compare it with')
  expect(refusalText({ ...bare, gate: 'rate', message: 'Slower.', count: 9 })).toBe(
    'Refused at the gate ‘rate’: Slower. Send no faster than `max_rate_hz` of the connector. (and 8 more)',
  )
})

test('a reason is its sentence and what the robot adds', () => {
  expect(whyText({ code: 'lease.taken_over', message: 'wall ahead' })).toBe('A supervisor took the lease over. “wall ahead”')
})

describe('news', () => {
  test('of what I pressed myself is none', () => expect(noticeOf({ type: 'granted', resource: 'motion' }, false)).toBeNull())

  test('of a grant after a wait is said', () => expect(noticeOf({ type: 'granted', resource: 'arm' }, true)?.title).toBe('You have control of arm.'))

  test('of a loss stays until it is read, with its sentence', () => {
    const notice = noticeOf({ type: 'lost', resource: 'motion', code: 'lease.preempted' }, false)
    expect(notice?.shownMs).toBeNull()
    expect(notice?.text).toContain('person took')
  })

  test('of what I handed over myself is none', () => expect(noticeOf({ type: 'lost', resource: 'motion', code: 'lease.handed_over' }, false)).toBeNull())
})

describe('who is here', () => {
  const present = presentOf([PATROL, ME, { ...ALICE, role: 'supervisor' }], { motion: ALICES })

  test('comes in the order that matters', () => expect(present.map(({ name }) => name)).toEqual(['Alice', 'You', 'patrol']))

  test('is said in a sentence', () => expect(presenceSentence(present)).toBe('Driving: Alice. Watching: You, patrol.'))

  test('nobody drives', () => expect(presenceSentence(presentOf([ME], { motion: FREE }))).toBe('Driving: nobody. Watching: You.'))
})
