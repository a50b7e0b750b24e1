import { expect, test } from 'vitest'
import { Pace } from '../src/control/Pace'
import { StopLatch } from '../src/control/StopLatch'
import { TalkFloor } from '../src/control/TalkFloor'
import { ADA } from './fakes'

test('so many at once, and then so many a second', () => {
  const pace = new Pace(10, 3)
  expect([0, 0, 0, 0].map((at) => pace.admits(at))).toEqual([true, true, true, false])
  expect([100, 100].map((at) => pace.admits(at))).toEqual([true, false])
  expect([9000, 9000, 9000, 9000].map((at) => pace.admits(at))).toEqual([true, true, true, false])
})

test('anybody stops, every copy is acknowledged with the time of the first, and the others hear of it once', () => {
  const latch = new StopLatch()
  const observer = { ...ADA, role: 'observer' } as const
  expect(latch.stop({ id: 'a', reason: 'cat' }, observer, 10)).toEqual({ ack: { id: 'a', receivedUs: 10, safeUs: 10 }, isNew: true })
  expect(latch.stop({ id: 'a', reason: 'cat' }, observer, 30)).toEqual({ ack: { id: 'a', receivedUs: 10, safeUs: 10 }, isNew: false })
  expect(latch.state).toEqual({ isStopped: true, by: 'Ada', byAccount: 'ada', reason: 'cat', sinceUs: 10 })
})

test('a supervisor who is a person clears it', () => {
  const latch = new StopLatch()
  latch.stop({ id: 'a', reason: '' }, ADA, 0)
  expect(latch.clear({ ...ADA, role: 'observer' })).toBe('lease.forbidden')
  expect(latch.clear(ADA)).toBe('lease.required')
  expect(latch.clear({ ...ADA, role: 'supervisor', isProgram: true })).toBe('safety.person_clears')
  expect(latch.isStopped).toBe(true)
  expect(latch.clear({ ...ADA, role: 'supervisor' })).toBeNull()
  expect(latch.isStopped).toBe(false)
})

test('the stops that are remembered have a bound', () => {
  const latch = new StopLatch()
  for (let id = 0; id < 1000; id += 1) latch.stop({ id: String(id), reason: '' }, ADA, id)
  expect(latch.stop({ id: '0', reason: '' }, ADA, 5000).ack.receivedUs).toBe(5000)
  expect(latch.stop({ id: '999', reason: '' }, ADA, 5000).ack.receivedUs).toBe(999)
})

test('one talks at a time, with pauses between words', () => {
  const floor = new TalkFloor()
  expect(floor.heard('a', 0)).toBe(true)
  expect(floor.heard('b', 100)).toBe(false)
  expect(floor.heard('a', 400)).toBe(true)
  expect(floor.talker(899)).toBe('a')
  expect(floor.talker(900)).toBeNull()
  expect(floor.heard('b', 900)).toBe(true)
  floor.left('a')
  expect(floor.talker(901)).toBe('b')
  floor.left('b')
  expect(floor.talker(902)).toBeNull()
})
