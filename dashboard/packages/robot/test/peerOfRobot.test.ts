import fc from 'fast-check'
import { expect, test } from 'vitest'
import { RobotPeerMachine, type RobotPeerEvent } from '../src/peers/peerOfRobot'

function after(...events: RobotPeerEvent['type'][]): RobotPeerMachine {
  const machine = new RobotPeerMachine(0)
  for (const type of events) machine.handle({ type, code: 'x' }, 0)
  return machine
}

test('a hello opens it, once', () => {
  const machine = after('answered', 'securing', 'connected')
  expect(machine.phase).toBe('greeting')
  expect(machine.handle({ type: 'helloHeard' }, 0)).toEqual([{ type: 'greet' }])
  expect(machine.handle({ type: 'helloHeard' }, 0)).toEqual([])
})

test('a hello may overtake the word that it is connected', () => {
  expect(after('answered').handle({ type: 'helloHeard' }, 0)).toEqual([{ type: 'greet' }])
})

test.each([
  [[], 15_000, 'sdp.timeout'],
  [['answered'], 20_000, 'ice.timeout'],
  [['answered', 'securing'], 10_000, 'dtls.timeout'],
  [['answered', 'securing', 'connected'], 10_000, 'channel.timeout'],
  [['answered', 'helloHeard'], 2000, 'peer.lost'],
] as const)('after %j it waits %i ms and no longer', (events, afterMs, code) => {
  const machine = after(...events)
  expect(machine.deadlineMs).toBe(afterMs)
  expect(machine.handle({ type: 'deadlinePassed' }, afterMs - 1)).toEqual([])
  expect(machine.handle({ type: 'deadlinePassed' }, afterMs)).toMatchObject([{ type: 'close', code, sayBye: false }])
})

test('whoever is heard is there', () => {
  const machine = after('helloHeard')
  machine.handle({ type: 'operatorHeard' }, 1500)
  expect(machine.deadlineMs).toBe(3500)
})

test('silence that is noticed late proves nothing: the page stood still', () => {
  const machine = after('helloHeard')
  expect(machine.handle({ type: 'deadlinePassed' }, 30_000)).toEqual([])
  expect(machine.handle({ type: 'deadlinePassed' }, 30_500)).toMatchObject([{ code: 'peer.lost' }])
})

test('only who can hear it is told goodbye', () => {
  const close = { type: 'closeWanted', code: 'peer.shutdown' } as const
  expect(after('answered').handle(close, 0)).toMatchObject([{ sayBye: false }])
  expect(after('helloHeard').handle(close, 0)).toMatchObject([{ sayBye: true }])
  expect(after('helloHeard').handle({ type: 'byeHeard', code: 'peer.closed' }, 0)).toMatchObject([{ code: 'peer.closed', sayBye: false }])
})

test('what breaks a connection that was up is a loss', () => {
  expect(after('answered').handle({ type: 'broken', code: 'ice.failed' }, 0)).toMatchObject([{ code: 'ice.failed' }])
  expect(after('helloHeard').handle({ type: 'broken', code: 'ice.failed' }, 0)).toMatchObject([{ code: 'peer.lost' }])
})

test('whatever happens, it greets and ends at most once, and waits only while it lives', () => {
  const types = ['answered', 'securing', 'connected', 'helloHeard', 'operatorHeard', 'byeHeard', 'broken', 'closeWanted', 'deadlinePassed'] as const
  fc.assert(
    fc.property(fc.array(fc.tuple(fc.constantFrom(...types), fc.nat(5000))), (walk) => {
      const machine = new RobotPeerMachine(0)
      const told: string[] = []
      let now = 0
      for (const [type, ms] of walk) {
        now += ms
        told.push(...machine.handle({ type, code: 'x' }, now).map((effect) => effect.type))
        expect(machine.deadlineMs === null).toBe(machine.phase === 'closed')
      }
      expect(told.filter((one) => one === 'greet').length).toBeLessThanOrEqual(1)
      expect(told.indexOf('close')).toBe(told.includes('close') ? told.length - 1 : -1)
    }),
  )
})
