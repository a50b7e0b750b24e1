import { afterEach, beforeEach, expect, test, vi } from 'vitest'
import { DeadlineTimer } from '../../src/timing/DeadlineTimer'

beforeEach(() => {
  vi.useFakeTimers({ toFake: ['setTimeout', 'clearTimeout'] })
})

afterEach(() => {
  vi.useRealTimers()
})

function bench() {
  const clock = { nowMs: 1000 }
  const lateMs: number[] = []
  const timer = new DeadlineTimer({ now: () => clock.nowMs }, (late) => void lateMs.push(late))
  const pass = (ms: number, sleptMs = 0): void => {
    clock.nowMs += ms + sleptMs
    vi.advanceTimersByTime(ms)
  }
  return { timer, lateMs, pass }
}

test('it calls back once, at its moment', () => {
  const { timer, lateMs, pass } = bench()
  timer.set(1500)
  pass(499)
  expect(lateMs).toEqual([])
  pass(1)
  pass(5000)
  expect(lateMs).toEqual([0])
})

test('only the last deadline counts, and none is none', () => {
  const { timer, lateMs, pass } = bench()
  timer.set(1100)
  timer.set(1700)
  pass(699)
  expect(lateMs).toEqual([])
  timer.set(null)
  pass(5000)
  expect(lateMs).toEqual([])
})

test('what is due already calls back at once, but never while it is asked for', () => {
  const { timer, lateMs, pass } = bench()
  timer.set(400)
  expect(lateMs).toEqual([])
  pass(0)
  expect(lateMs).toEqual([600])
})

test('it says how late it was after a sleep', () => {
  const { timer, lateMs, pass } = bench()
  timer.set(1500)
  pass(500, 60_000)
  expect(lateMs).toEqual([60_000])
})
