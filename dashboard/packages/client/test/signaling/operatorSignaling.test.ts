import { parseSignaling } from '@mosaic/protocol'
import fc from 'fast-check'
import { describe, expect, test } from 'vitest'
import { OperatorSignaling } from '../../src/signaling/operatorSignaling'
import type { SignalingEffect, SignalingEvent } from '../../src/signaling/signalingSession'

class Bench {
  readonly session = new OperatorSignaling(() => 1)
  nowMs = 0

  give(...events: SignalingEvent[]): SignalingEffect[] {
    return events.flatMap((event) => this.session.handle(event, this.nowMs))
  }

  hear(type: string, data: unknown): SignalingEffect[] {
    return this.give({ type: 'heard', message: parseSignaling(JSON.stringify({ type, data })) })
  }

  pass(ms: number): SignalingEffect[] {
    const untilMs = this.nowMs + ms
    const effects: SignalingEffect[] = []
    for (let wakeMs = this.session.deadlineMs; wakeMs !== null && wakeMs <= untilMs; wakeMs = this.session.deadlineMs) {
      this.nowMs = Math.max(this.nowMs, wakeMs)
      effects.push(...this.give({ type: 'deadlinePassed' }))
    }
    this.nowMs = untilMs
    return effects
  }

  online(): this {
    this.give({ type: 'started', token: 't' }, { type: 'opened' })
    this.hear('authorize.res', 100)
    return this
  }
}

const types = (effects: SignalingEffect[]): string[] => effects.map(({ type }) => type)

describe('signing in', () => {
  test('waits for the request and is online with 100', () => {
    const bench = new Bench()
    expect(bench.session.state).toBe('offline')
    expect(types(bench.give({ type: 'started', token: 't' }))).toEqual(['open'])
    expect(bench.session.state).toBe('connecting')
    bench.give({ type: 'opened' })
    const answer = { type: 'send', word: 'authorize', data: { accessToken: 't' } }
    expect(bench.hear('authorize.req', null)).toEqual([answer])
    expect(bench.hear('authorize.res', 100)).toEqual([])
    expect(bench.session.state).toBe('online')
  })

  test('accepts of the offered extensions those that it knows', () => {
    const bench = new Bench()
    bench.give({ type: 'started', token: 't' }, { type: 'opened' })
    const [effect] = bench.hear('authorize.req', { extensions: { catalogue: 9, telepathy: 1 } })
    expect(effect).toEqual({ type: 'send', word: 'authorize', data: { accessToken: 't', extensions: { catalogue: 1 } } })
  })

  test.each([
    ['authorize.res', 2004, 'auth.expired'],
    ['authorize.res', 10021, 'auth.failed'],
    ['authorize.res', 10000, 'auth.failed'],
    ['authorize', 10060, 'auth.failed'],
  ])('%s %i is a refusal: %s, and no retry', (type, code, reason) => {
    const bench = new Bench()
    bench.give({ type: 'started', token: 't' }, { type: 'opened' })
    expect(bench.hear(type, code)).toEqual([{ type: 'close' }, { type: 'tellRefused', code: reason }])
    expect(bench.pass(100_000)).toEqual([])
    expect(bench.session.state).toBe('offline')
  })

  test('a server that does not answer is given up after ten seconds and tried again', () => {
    const bench = new Bench()
    bench.give({ type: 'started', token: 't' }, { type: 'opened' })
    expect(types(bench.pass(10_500))).toEqual(['close', 'open'])
    expect(bench.session.state).toBe('offline')
  })
})

describe('coming back', () => {
  test.each([1000, 1001, 1006, 1012, 4400, 4408, 4429])('after close code %i', (closeCode) => {
    const bench = new Bench().online()
    expect(bench.give({ type: 'closed', closeCode })).toEqual([])
    expect([bench.session.phase, bench.session.state]).toEqual(['waiting', 'offline'])
    expect(types(bench.pass(500))).toEqual(['open'])
  })

  test.each([
    [4401, 'auth.failed'],
    [4403, 'auth.forbidden'],
    [4409, 'signal.replaced'],
  ])('not after %i', (closeCode, code) => {
    const bench = new Bench().online()
    expect(bench.give({ type: 'closed', closeCode })).toEqual([{ type: 'tellRefused', code }])
    expect(bench.pass(100_000)).toEqual([])
  })

  test('pauses grow to ten seconds and are short again once online', () => {
    const bench = new Bench()
    bench.give({ type: 'started', token: 't' })
    const pauses = Array.from({ length: 6 }, () => {
      bench.give({ type: 'closed', closeCode: 1006 })
      const pause = (bench.session.deadlineMs ?? NaN) - bench.nowMs
      bench.pass(pause)
      return pause
    })
    expect(pauses).toEqual([500, 1000, 2000, 4000, 8000, 10_000])
    bench.give({ type: 'opened' })
    bench.hear('authorize.res', 100)
    bench.give({ type: 'closed', closeCode: 1006 })
    expect((bench.session.deadlineMs ?? NaN) - bench.nowMs).toBe(500)
  })

  test('at once when the network is back', () => {
    const bench = new Bench().online()
    bench.give({ type: 'closed', closeCode: 1006 })
    expect(types(bench.give({ type: 'networkChanged' }))).toEqual(['open'])
    expect(types(bench.give({ type: 'networkChanged' }))).toEqual(['close', 'open'])
  })

  test('at once when a doubted server says nothing, and not at all when it does', () => {
    const bench = new Bench().online()
    expect(bench.give({ type: 'doubted' })).toEqual([])
    bench.hear('ping.ping', { pingId: 'p' })
    expect(types(bench.pass(700))).toEqual([])
    bench.give({ type: 'doubted' })
    expect(types(bench.pass(699))).toEqual([])
    expect(types(bench.pass(1))).toEqual(['close', 'open'])
  })
})

describe('online', () => {
  test('answers pings', () => {
    const bench = new Bench().online()
    expect(bench.hear('ping.ping', { pingId: 'p' })).toEqual([{ type: 'send', word: 'ping.pong', data: { pingId: 'p' } }])
  })

  test('a server that pinged and then is silent for 15 s is gone', () => {
    const bench = new Bench().online()
    bench.hear('ping.ping', { pingId: 'p' })
    bench.pass(14_000)
    bench.hear('status.update', { robotId: 'r', status: 0 })
    expect(bench.pass(14_999)).toEqual([])
    expect(types(bench.pass(1))).toEqual(['close'])
  })

  test('a server that never pings may be silent for ever', () => {
    expect(new Bench().online().pass(1e9)).toEqual([])
  })

  test('passes everything else on', () => {
    const bench = new Bench().online()
    const [effect] = bench.hear('status.update', { robotId: 'r', status: 0 })
    expect(effect).toMatchObject({ type: 'tellMessage', message: { data: { robotId: 'r', status: 0 } } })
    expect(types(bench.hear('status.subscribe', 10000))).toEqual(['tellMessage'])
  })

  test('stopping closes the socket; starting again signs in anew', () => {
    const bench = new Bench().online()
    expect(types(bench.give({ type: 'stopped' }))).toEqual(['close'])
    expect(bench.give({ type: 'stopped' }, { type: 'closed', closeCode: 1000 }, { type: 'opened' })).toEqual([])
    expect(bench.hear('status.update', { status: 0 })).toEqual([])
    expect(types(bench.give({ type: 'started', token: 'u' }))).toEqual(['open'])
  })
})

test('on every walk there is at most one socket', () => {
  const events: SignalingEvent[] = [
    { type: 'started', token: 't' },
    { type: 'stopped' },
    { type: 'opened' },
    { type: 'closed', closeCode: 1006 },
    { type: 'closed', closeCode: 4401 },
    { type: 'heard', message: { type: 'authorize.res', data: 100 } },
    { type: 'heard', message: { type: 'authorize.res', data: 10021 } },
    { type: 'heard', message: { type: 'ping.ping', data: { pingId: 'p' } } },
    { type: 'networkChanged' },
    { type: 'deadlinePassed' },
  ]
  fc.assert(
    fc.property(fc.array(fc.tuple(fc.constantFrom(...events), fc.nat(20_000)), { maxLength: 80 }), (steps) => {
      const bench = new Bench()
      let sockets = 0
      const count = (effects: SignalingEffect[]): void => {
        for (const { type } of effects) {
          if (type === 'open') sockets += 1
          if (type === 'close') sockets -= 1
          expect(sockets === 0 || sockets === 1).toBe(true)
        }
      }
      for (const [event, ms] of steps) {
        count(bench.pass(ms))
        if (event.type === 'closed' && sockets === 1) sockets = 0
        else if (event.type === 'closed') continue
        count(bench.give(event))
      }
    }),
    { numRuns: 500 },
  )
})
