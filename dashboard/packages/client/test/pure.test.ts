import fc from 'fast-check'
import { describe, expect, test, vi } from 'vitest'
import { backoffDelayMs } from '../src/timing/backoff'
import { ClockOffset } from '../src/timing/ClockOffset'
import { LingerCount } from '../src/stores/lingerCount'
import { editDistance, nearestName } from '../src/words/nearestName'
import { randomId } from '../src/platform/randomId'
import { Listeners, Value } from '../src/platform/Readable'

describe('backoffDelayMs', () => {
  const options = { baseMs: 500, maxMs: 10_000 }

  test('doubles from attempt to attempt and stops growing', () => {
    expect([0, 1, 2, 3, 4, 5, 100].map((attempt) => backoffDelayMs(attempt, 1, options))).toEqual([
      500, 1000, 2000, 4000, 8000, 10_000, 10_000,
    ])
  })

  test('lies between half and all of the full time', () => {
    fc.assert(
      fc.property(fc.nat(2000), fc.double({ min: 0, max: 0.999, noNaN: true }), (attempt, random) => {
        const fullMs = backoffDelayMs(attempt, 1, options)
        const delayMs = backoffDelayMs(attempt, random, options)
        expect(delayMs).toBeGreaterThanOrEqual(fullMs / 2)
        expect(delayMs).toBeLessThanOrEqual(fullMs)
      }),
    )
  })
})

describe('ClockOffset', () => {
  test('knows nothing before the first answer', () => {
    const clocks = new ClockOffset()
    expect([clocks.offsetUs, clocks.roundTripMs, clocks.ageMs(1, 1)]).toEqual([null, null, null])
  })

  test('finds the offset of a robot whose way there takes as long as the way back', () => {
    const clocks = new ClockOffset()
    clocks.add(1000, 501_000, 501_200, 3200)
    expect(clocks.roundTripMs).toBe(2)
    expect(clocks.offsetUs).toBe(499_000)
  })

  test('trusts the shortest round trip, not the last', () => {
    const clocks = new ClockOffset()
    clocks.add(0, 1000, 1000, 200)
    clocks.add(10_000, 60_000, 60_000, 110_000)
    expect(clocks.offsetUs).toBe(900)
    expect(clocks.roundTripMs).toBe(100)
  })

  test('forgets samples of half a minute ago, because clocks drift', () => {
    const clocks = new ClockOffset()
    clocks.add(0, 1000, 1000, 200)
    clocks.add(40_000_000, 40_005_000, 40_005_000, 40_002_000)
    expect(clocks.offsetUs).toBe(4000)
  })

  test('ignores an answer that came before the question', () => {
    const clocks = new ClockOffset()
    clocks.add(1000, 0, 0, 500)
    expect(clocks.offsetUs).toBeNull()
  })

  test('tells the age of a stamp, and never a negative one', () => {
    const clocks = new ClockOffset()
    clocks.add(0, 1_000_000, 1_000_000, 0)
    expect(clocks.ageMs(1_000_000, 25)).toBe(25)
    expect(clocks.ageMs(2_000_000, 25)).toBe(0)
  })

  test('errs by at most half of the shortest round trip', () => {
    const delaysUs = fc.array(fc.tuple(fc.nat(50_000), fc.nat(50_000)), { minLength: 1, maxLength: 20 })
    fc.assert(
      fc.property(delaysUs, fc.integer({ min: -1e12, max: 1e12 }), (delays, offsetUs) => {
        const clocks = new ClockOffset()
        delays.forEach(([there, back], index) => {
          const t0 = index * 500_000
          clocks.add(t0, t0 + there + offsetUs, t0 + there + offsetUs, t0 + there + back)
        })
        const shortest = Math.min(...delays.map(([there, back]) => there + back))
        expect(Math.abs((clocks.offsetUs ?? NaN) - offsetUs)).toBeLessThanOrEqual(shortest / 2)
      }),
    )
  })
})

describe('nearestName', () => {
  test.each([
    ['cmdvel', 'cmd_vel'],
    ['cmd-vel', 'cmd_vel'],
    ['Battery', 'battery'],
    ['batery', 'battery'],
    ['bttaery', 'battery'],
  ])('%s was perhaps meant to be %s', (name, meant) => {
    expect(nearestName(name, ['cmd_vel', 'battery', 'front'])).toBe(meant)
  })

  test('nothing is near to something else, or to nothing', () => {
    expect(nearestName('lidar', ['battery', 'front'])).toBeNull()
    expect(nearestName('lidar', [])).toBeNull()
  })

  test('the distance is zero only for the same name, symmetric, and at most the longer length', () => {
    fc.assert(
      fc.property(fc.string({ maxLength: 12 }), fc.string({ maxLength: 12 }), (a, b) => {
        expect(editDistance(a, b) === 0).toBe(a === b)
        expect(editDistance(a, b)).toBe(editDistance(b, a))
        expect(editDistance(a, b)).toBeLessThanOrEqual(Math.max(a.length, b.length))
      }),
    )
  })

  test('a swap of neighbours is one mistake', () => {
    expect(editDistance('ab', 'ba')).toBe(1)
  })
})

describe('LingerCount', () => {
  test('the first user makes, the last one leaves, and the rest is silence for a while', () => {
    const counts = new LingerCount<string>(1000)
    expect(counts.retain('a')).toBe(true)
    expect(counts.retain('a')).toBe(false)
    expect(counts.release('a', 0)).toBe(false)
    expect(counts.release('a', 100)).toBe(true)
    expect(counts.nextExpiryMs()).toBe(1100)
    expect(counts.expired(1099)).toEqual([])
    expect(counts.expired(1100)).toEqual(['a'])
    expect(counts.nextExpiryMs()).toBeNull()
    expect(counts.retain('a')).toBe(true)
  })

  test('who comes back in time finds what was there', () => {
    const counts = new LingerCount<string>(1000)
    counts.retain('a')
    counts.release('a', 0)
    expect(counts.retain('a')).toBe(false)
    expect(counts.expired(5000)).toEqual([])
  })

  test('a release too many does nothing', () => {
    const counts = new LingerCount<string>(1000)
    expect(counts.release('a', 0)).toBe(false)
    counts.retain('a')
    counts.release('a', 0)
    expect(counts.release('a', 500)).toBe(false)
    expect(counts.nextExpiryMs()).toBe(1000)
  })

  test('a key is expired exactly when every retain was matched long enough ago', () => {
    const step = fc.record({ retain: fc.boolean(), afterMs: fc.nat(1500) })
    fc.assert(
      fc.property(fc.array(step, { maxLength: 40 }), (steps) => {
        const counts = new LingerCount<string>(1000)
        let nowMs = 0
        let users = 0
        let emptyAtMs: number | null = null
        for (const { retain, afterMs } of steps) {
          nowMs += afterMs
          const expired = emptyAtMs !== null && nowMs - emptyAtMs >= 1000
          expect(counts.expired(nowMs)).toEqual(expired ? ['k'] : [])
          if (expired) emptyAtMs = null
          if (retain) counts.retain('k')
          else counts.release('k', nowMs)
          if (!retain && users === 1) emptyAtMs = nowMs
          if (retain) emptyAtMs = null
          users = Math.max(0, users + (retain ? 1 : -1))
        }
      }),
    )
  })
})

test('random ids are UUIDs of version 4 and differ', () => {
  const ids = Array.from({ length: 50 }, randomId)
  for (const id of ids) expect(id).toMatch(/^[0-9a-f]{8}-[0-9a-f]{4}-4[0-9a-f]{3}-[89ab][0-9a-f]{3}-[0-9a-f]{12}$/)
  expect(new Set(ids).size).toBe(50)
})

describe('Value', () => {
  test('tells of changes, and of changes only', () => {
    const value = new Value(1)
    const listener = vi.fn()
    const unsubscribe = value.subscribe(listener)
    value.set(1)
    expect(listener).not.toHaveBeenCalled()
    value.set(2)
    expect([value.get(), listener.mock.calls.length]).toEqual([2, 1])
    unsubscribe()
    value.set(3)
    expect(listener).toHaveBeenCalledTimes(1)
  })

  test('a listener that throws, at once or later, disturbs nobody', async () => {
    const report = vi.spyOn(console, 'error').mockImplementation(() => {})
    const listeners = new Listeners<[number]>()
    const heard: number[] = []
    listeners.add(() => {
      throw new Error('at once')
    })
    listeners.add(() => Promise.reject(new Error('later')))
    listeners.add((n) => heard.push(n))
    listeners.tell(7)
    await Promise.resolve()
    expect(heard).toEqual([7])
    expect(report).toHaveBeenCalledTimes(2)
    report.mockRestore()
  })

  test('a listener may leave while all are told, and the same function may come twice', () => {
    const listeners = new Listeners<[]>()
    const second = vi.fn()
    listeners.add(() => leave())
    const leave = listeners.add(second)
    listeners.tell()
    expect(second).not.toHaveBeenCalled()
    const twice = vi.fn()
    listeners.add(twice)
    const leaveOnce = listeners.add(twice)
    leaveOnce()
    listeners.tell()
    expect(twice).toHaveBeenCalledTimes(1)
  })
})
