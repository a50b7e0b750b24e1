import { afterEach, beforeEach, expect, test, vi } from 'vitest'
import { MachineDriver, type DeadlinePassed, type Machine } from '../../src/timing/MachineDriver'

type Event = { type: 'rang'; times: number } | DeadlinePassed

/** Answers a ring at once, and once more a second later. */
class Bell implements Machine<Event, string> {
  deadlineMs: number | null = null

  handle(event: Event, nowMs: number): string[] {
    this.deadlineMs = event.type === 'rang' ? nowMs + 1000 : null
    return event.type === 'rang' ? Array.from({ length: event.times }, (_, index) => `ring ${index + 1}`) : ['echo']
  }
}

beforeEach(() => void vi.useFakeTimers({ toFake: ['setTimeout', 'clearTimeout'] }))

afterEach(() => void vi.useRealTimers())

function bench(carryOut: (effect: string) => void = () => {}) {
  const clock = { nowMs: 0, now: () => clock.nowMs }
  const seen: string[] = []
  const machine = new Bell()
  const driver = new MachineDriver<Event, string>(machine, clock, {
    decided: () => seen.push(`decided, due at ${machine.deadlineMs ?? 'no time'}`),
    carryOut: (effect) => {
      seen.push(effect)
      carryOut(effect)
    },
    woken: (lateMs) => seen.push(`woken ${lateMs} ms late`),
  })
  const pass = (ms: number, sleptMs = 0): void => {
    clock.nowMs += ms + sleptMs
    vi.advanceTimersByTime(ms)
  }
  return { driver, seen, pass }
}

test('what the machine decided is known before anything is carried out, and its deadline is kept', () => {
  const { driver, seen, pass } = bench()
  driver.tell({ type: 'rang', times: 2 })
  expect(seen).toEqual(['decided, due at 1000', 'ring 1', 'ring 2'])
  pass(999)
  expect(seen).toHaveLength(3)
  pass(1)
  expect(seen.slice(3)).toEqual(['woken 0 ms late', 'decided, due at no time', 'echo'])
})

test('an event that an effect brings about is done with before the next effect', () => {
  const { driver, seen } = bench((effect) => {
    if (effect === 'ring 1') driver.tell({ type: 'deadlinePassed' })
  })
  driver.tell({ type: 'rang', times: 2 })
  expect(seen).toEqual(['decided, due at 1000', 'ring 1', 'decided, due at no time', 'echo', 'ring 2'])
})

test('it says how late the page was, and watches nothing once it is stopped', () => {
  const { driver, seen, pass } = bench()
  driver.tell({ type: 'rang', times: 0 })
  pass(1000, 60_000)
  expect(seen).toContain('woken 60000 ms late')
  driver.tell({ type: 'rang', times: 0 })
  driver.stop()
  seen.length = 0
  pass(5000)
  expect(seen).toEqual([])
})

test('one that its own effect stops carries out nothing more, takes nothing and watches nothing', () => {
  const { driver, seen, pass } = bench(() => driver.stop())
  driver.tell({ type: 'rang', times: 2 })
  driver.tell({ type: 'rang', times: 1 })
  pass(2000)
  expect(seen).toEqual(['decided, due at 1000', 'ring 1'])
})
