import fc from 'fast-check'
import { describe, expect, test } from 'vitest'
import type { PeerEffect, PeerEvent } from '../../src/peers/peerEvents'
import { OperatorPeerMachine } from '../../src/peers/peerOfOperator'

/** A session with a clock to turn. */
class Bench {
  readonly session = new OperatorPeerMachine(() => 1)
  nowMs = 1000

  give(...events: PeerEvent[]): string[] {
    return events.flatMap((event) => this.session.handle(event, this.nowMs)).map(named)
  }

  /** Let time pass, waking the session when it asks for it. */
  pass(ms: number): string[] {
    const untilMs = this.nowMs + ms
    const effects: string[] = []
    for (;;) {
      const wakeMs = this.session.deadlineMs
      if (wakeMs === null || wakeMs > untilMs) break
      this.nowMs = Math.max(this.nowMs, wakeMs)
      effects.push(...this.give({ type: 'deadlinePassed' }))
    }
    this.nowMs = untilMs
    return effects
  }

  connected(): this {
    this.give(...CONNECT)
    return this
  }

  greeted(): this {
    this.connected()
    this.give({ type: 'helloHeard' })
    return this
  }
}

const CONNECT: PeerEvent[] = [
  { type: 'connectWanted' },
  { type: 'granted' },
  { type: 'offered' },
  { type: 'answered' },
  { type: 'iceConnected' },
  { type: 'linkConnected' },
  { type: 'controlOpened' },
]

function named(effect: PeerEffect): string {
  if (effect.type === 'drop') return effect.bye ? 'drop with bye' : 'drop'
  return 'code' in effect && effect.code ? `${effect.type} ${effect.code}` : effect.type
}

describe('connecting', () => {
  test('goes through its phases to connected', () => {
    const bench = new Bench()
    expect(bench.session.publicPhase).toBe('idle')
    const phases = CONNECT.map((event) => {
      bench.give(event)
      return bench.session.phase
    })
    expect(phases).toEqual(['requesting', 'offering', 'answering', 'linking', 'linking', 'opening', 'up'])
    expect(bench.session.publicPhase).toBe('connected')
  })

  test('asks, offers and says hello in this order', () => {
    expect(new Bench().give(...CONNECT)).toEqual(['request', 'makeOffer', 'sendHello', 'tellConnected'])
  })

  test('the control channel may open before the browser says that the link is there', () => {
    const bench = new Bench()
    bench.give(...CONNECT.slice(0, 4), { type: 'controlOpened' }, { type: 'linkConnected' })
    expect(bench.session.phase).toBe('up')
  })

  test('wanting it twice changes nothing', () => {
    const bench = new Bench().connected()
    expect(bench.give({ type: 'connectWanted' })).toEqual([])
    expect(bench.session.phase).toBe('up')
  })

  test.each([
    ['requesting', 1, 8000, 'signal.unreachable'],
    ['offering', 2, 5000, 'sdp.timeout'],
    ['answering', 3, 10_000, 'signal.no_answer'],
    ['linking', 4, 15_000, 'ice.timeout'],
    ['linking after ICE', 5, 10_000, 'dtls.timeout'],
    ['opening', 6, 5000, 'channel.timeout'],
  ])('%s has its time-out and its code', (_phase, events, afterMs, code) => {
    const bench = new Bench()
    bench.give(...CONNECT.slice(0, events))
    expect(bench.pass(afterMs - 1)).toEqual([])
    expect(bench.pass(1)).toContain('drop')
    expect(bench.session.reason.code).toBe(code)
  })

  test('a first connection is tried three times, then it has failed', () => {
    const bench = new Bench()
    bench.give({ type: 'connectWanted' })
    expect(bench.give({ type: 'broken', code: 'ice.failed' })).toEqual(['drop'])
    expect(bench.session.publicPhase).toBe('connecting')
    expect(bench.pass(500)).toEqual(['request'])
    bench.give({ type: 'broken', code: 'ice.failed' })
    expect(bench.pass(999)).toEqual([])
    expect(bench.pass(1)).toEqual(['request'])
    expect(bench.give({ type: 'broken', code: 'ice.failed', message: 'no' })).toEqual(['drop', 'tellFailed ice.failed'])
    expect(bench.session.publicPhase).toBe('failed')
    expect(bench.session.reason).toEqual({ code: 'ice.failed', message: 'no' })
    expect(bench.pass(100_000)).toEqual([])
    expect(bench.give({ type: 'connectWanted' })).toEqual(['request'])
  })

  test('a robot that has somebody else is asked again for a minute: a killed page may hold it for most of that', () => {
    const bench = new Bench()
    bench.give({ type: 'connectWanted' })
    const startMs = bench.nowMs
    while (bench.session.phase !== 'failed') {
      expect(bench.session.publicPhase).toBe('connecting')
      bench.give({ type: 'broken', code: 'signal.robot_busy' })
      if (bench.session.phase === 'waiting') bench.pass((bench.session.deadlineMs ?? 0) - bench.nowMs)
    }
    expect(bench.nowMs - startMs).toBeGreaterThanOrEqual(60_000)
    expect(bench.nowMs - startMs).toBeLessThan(71_000)
  })

  test('what fails once the robot is free has its three attempts', () => {
    const bench = new Bench()
    bench.give({ type: 'connectWanted' })
    for (let attempt = 0; attempt < 4; attempt += 1) {
      bench.give({ type: 'broken', code: 'signal.robot_busy' })
      bench.pass(10_000)
    }
    bench.give({ type: 'broken', code: 'ice.failed' })
    expect(bench.session.publicPhase).toBe('connecting')
  })

  test('a page that is left asks no more', () => {
    const bench = new Bench()
    bench.give({ type: 'connectWanted' }, { type: 'broken', code: 'signal.robot_busy' }, { type: 'disconnectWanted' })
    expect(bench.pass(60_000)).toEqual([])
  })

  test.each(['auth.forbidden', 'auth.failed', 'peer.not_allowed', 'sdp.no_common_codec'])(
    '%s fails at once: trying again changes nothing',
    (code) => {
      const bench = new Bench()
      bench.give({ type: 'connectWanted' })
      expect(bench.give({ type: 'broken', code })).toEqual(['drop', `tellFailed ${code}`])
      expect(bench.give({ type: 'robotReady' })).toEqual([])
    },
  )

  test('what failed for want of a robot heals when the robot comes', () => {
    const bench = new Bench()
    bench.give({ type: 'connectWanted' })
    for (let attempt = 0; attempt < 3; attempt += 1) {
      bench.give({ type: 'broken', code: 'signal.robot_offline' })
      if (bench.session.phase === 'waiting') bench.pass(2000)
    }
    expect(bench.session.phase).toBe('failed')
    expect(bench.give({ type: 'robotReady' })).toEqual(['request'])
  })

  test('a robot that comes online cuts the waiting short', () => {
    const bench = new Bench()
    bench.give({ type: 'connectWanted' }, { type: 'broken', code: 'signal.robot_offline' })
    expect(bench.give({ type: 'robotReady' })).toEqual(['request'])
    expect(bench.give({ type: 'robotReady' })).toEqual([])
  })
})

describe('hello', () => {
  test('a robot that says hello is pinged twice a second', () => {
    const bench = new Bench().connected()
    expect(bench.give({ type: 'helloHeard' })).toEqual(['sendPing'])
    expect(bench.session.isGreeted).toBe(true)
    expect(bench.pass(499)).toEqual([])
    expect(bench.pass(1)).toEqual(['sendPing'])
  })

  test('one that says none within two seconds is an original one and never pinged', () => {
    const bench = new Bench().connected()
    expect(bench.pass(1999)).toEqual([])
    expect(bench.pass(1)).toEqual(['treatAsOriginal'])
    expect(bench.session.isGreeted).toBe(false)
    expect(bench.pass(100_000)).toEqual([])
    expect(bench.session.phase).toBe('up')
  })

  test('a page that stood still waits for the hello once more, and no longer', () => {
    const bench = new Bench().connected()
    bench.nowMs += 60_000
    expect(bench.give({ type: 'deadlinePassed' })).toEqual([])
    expect(bench.pass(1999)).toEqual([])
    expect(bench.pass(1)).toEqual(['treatAsOriginal'])
  })

  test('a hello that comes too late changes nothing', () => {
    const bench = new Bench().connected()
    bench.pass(2000)
    expect(bench.give({ type: 'helloHeard' })).toEqual([])
    expect(bench.session.isGreeted).toBe(false)
  })
})

describe('silence', () => {
  test('two seconds of it mean that the robot is lost', () => {
    const bench = new Bench().greeted()
    expect(bench.pass(1999).filter((effect) => effect !== 'sendPing')).toEqual([])
    expect(bench.pass(1)).toEqual(['drop', 'tellDisconnected peer.lost', 'request'])
    expect(bench.session.publicPhase).toBe('reconnecting')
    expect(bench.session.reason.code).toBe('peer.lost')
  })

  test('any word of the robot keeps the connection', () => {
    const bench = new Bench().greeted()
    for (let second = 0; second < 30; second += 1) {
      bench.pass(1000)
      bench.give({ type: 'robotHeard' })
    }
    expect(bench.session.phase).toBe('up')
  })

  test('a page that was frozen asks again before it gives the robot up', () => {
    const bench = new Bench().greeted()
    bench.nowMs += 60_000
    expect(bench.give({ type: 'deadlinePassed' })).toEqual(['sendPing'])
    bench.give({ type: 'robotHeard' })
    expect(bench.pass(1500).every((effect) => effect === 'sendPing')).toBe(true)
    expect(bench.session.phase).toBe('up')
  })
})

test('a dead robot that is doubted is missed after three seconds of silence at the latest, whatever its patience', () => {
  const doubts = fc.array(fc.nat(1000), { minLength: 1, maxLength: 10 })
  fc.assert(
    fc.property(doubts, fc.integer({ min: 700, max: 60_000 }), (pausesMs, patienceMs) => {
      const bench = new Bench().greeted()
      const endMs = bench.nowMs + 3000
      const effects = pausesMs.flatMap((pauseMs) => [
        ...bench.pass(Math.min(pauseMs, endMs - bench.nowMs)),
        ...bench.give({ type: 'doubted', patienceMs }),
      ])
      expect([...effects, ...bench.pass(endMs - bench.nowMs)]).toContain('drop')
    }),
  )
})

describe('coming back', () => {
  test('a lost connection never gives up, with growing pauses up to ten seconds', () => {
    const bench = new Bench().greeted()
    bench.give({ type: 'broken', code: 'ice.failed' })
    const pauses = Array.from({ length: 8 }, () => {
      const pause = (bench.session.deadlineMs ?? NaN) - bench.nowMs
      expect(bench.pass(pause)).toEqual(['request'])
      bench.give({ type: 'broken', code: 'signal.unreachable' })
      return pause
    })
    expect(pauses).toEqual([0, 1000, 2000, 4000, 8000, 10_000, 10_000, 10_000])
    expect(bench.session.publicPhase).toBe('reconnecting')
  })

  test('after a hello the first try is made at once again', () => {
    const bench = new Bench().greeted()
    for (let round = 0; round < 5; round += 1) {
      bench.give({ type: 'broken', code: 'peer.lost' })
      expect((bench.session.deadlineMs ?? NaN) - bench.nowMs).toBe(0)
      bench.pass(0)
      bench.give(...CONNECT.slice(1), { type: 'helloHeard' })
      expect(bench.session.publicPhase).toBe('connected')
      expect(bench.session.reason).toEqual({})
    }
  })

  test('a robot that is doubted is lost without a word, and kept with one', () => {
    const bench = new Bench().greeted()
    expect(bench.give({ type: 'doubted', patienceMs: 700 })).toEqual(['sendPing'])
    bench.pass(300)
    bench.give({ type: 'robotHeard' })
    expect(bench.pass(1500)).not.toContain('drop')
    bench.give({ type: 'robotHeard' })
    bench.give({ type: 'doubted', patienceMs: 700 })
    expect(bench.pass(699)).not.toContain('drop')
    expect(bench.pass(1)).toContain('tellDisconnected peer.lost')
  })

  test('a doubt that a page which stood still comes back to gives the robot another moment', () => {
    const bench = new Bench().greeted()
    bench.give({ type: 'doubted', patienceMs: 700 })
    bench.nowMs += 5000
    bench.give({ type: 'robotHeard' })
    expect(bench.give({ type: 'deadlinePassed' })).not.toContain('drop')
  })

  test('an offer that went to a socket of before is made anew when the robot or the server is back', () => {
    const bench = new Bench().greeted()
    bench.give({ type: 'broken', code: 'peer.lost' })
    bench.pass(0)
    bench.give({ type: 'granted' }, { type: 'offered' })
    expect(bench.give({ type: 'robotReady' })).toEqual(['drop', 'request'])
  })

  test('another page with the same session takes over for good', () => {
    const bench = new Bench().greeted()
    const effects = bench.give({ type: 'broken', code: 'peer.replaced' })
    expect(effects).toEqual(['drop', 'tellDisconnected peer.replaced', 'tellFailed peer.replaced'])
    expect(bench.session.publicPhase).toBe('failed')
    expect(bench.pass(60_000)).toEqual([])
  })

  test('a robot that shuts down is waited for', () => {
    const bench = new Bench().greeted()
    bench.give({ type: 'broken', code: 'peer.shutdown' })
    expect(bench.session.publicPhase).toBe('reconnecting')
  })
})

describe('leaving', () => {
  test('disconnecting says goodbye', () => {
    const bench = new Bench().greeted()
    expect(bench.give({ type: 'disconnectWanted' })).toEqual(['drop with bye', 'tellDisconnected'])
    expect(bench.session.publicPhase).toBe('closed')
    expect(bench.pass(60_000)).toEqual([])
    expect(bench.give({ type: 'connectWanted' })).toEqual(['request'])
  })

  test('disconnecting between two attempts ends the trying', () => {
    const bench = new Bench()
    bench.give({ type: 'connectWanted' }, { type: 'broken', code: 'ice.failed' })
    expect(bench.give({ type: 'disconnectWanted' })).toEqual(['tellDisconnected'])
    expect(bench.pass(60_000)).toEqual([])
  })

  test('a page that is left says goodbye, and connects again if it is shown again', () => {
    const bench = new Bench().greeted()
    expect(bench.give({ type: 'pageHidden' })).toEqual(['drop with bye', 'tellDisconnected'])
    expect(bench.pass(60_000)).toEqual([])
    expect(bench.give({ type: 'robotReady' })).toEqual([])
    expect(bench.give({ type: 'pageShown' })).toEqual(['request'])
    expect(bench.session.publicPhase).toBe('reconnecting')
  })

  test('a page without a connection has nothing to say', () => {
    const bench = new Bench()
    expect(bench.give({ type: 'pageHidden' }, { type: 'pageShown' }, { type: 'disconnectWanted' })).toEqual([])
    expect(bench.session.phase).toBe('idle')
  })

  test('what comes after the end changes nothing', () => {
    const bench = new Bench().greeted()
    bench.give({ type: 'disconnectWanted' })
    const late: PeerEvent[] = [...CONNECT.slice(1), { type: 'helloHeard' }, { type: 'robotHeard' }]
    expect(bench.give(...late, { type: 'broken', code: 'ice.failed' }, { type: 'deadlinePassed' })).toEqual([])
    expect(bench.session.phase).toBe('closed')
  })

  test('a failed connection can be put away', () => {
    const bench = new Bench()
    bench.give({ type: 'connectWanted' }, { type: 'broken', code: 'auth.forbidden' }, { type: 'disconnectWanted' })
    expect(bench.session.publicPhase).toBe('closed')
  })
})

const EVENTS: PeerEvent[] = [
  ...CONNECT,
  { type: 'disconnectWanted' },
  { type: 'pageHidden' },
  { type: 'pageShown' },
  { type: 'robotReady' },
  { type: 'helloHeard' },
  { type: 'robotHeard' },
  { type: 'broken', code: 'ice.failed' },
  { type: 'broken', code: 'peer.replaced' },
  { type: 'deadlinePassed' },
]

test('on every walk peers are dropped before the next is asked for, and time never stands still', () => {
  const step = fc.record({ event: fc.constantFrom(...EVENTS), afterMs: fc.nat(3000) })
  fc.assert(
    fc.property(fc.array(step, { maxLength: 120 }), (steps) => {
      const bench = new Bench()
      let hasPeer = false
      const watch = (effects: string[]): void => {
        for (const effect of effects) {
          if (effect === 'request') {
            expect(hasPeer).toBe(false)
            hasPeer = true
          }
          if (effect.startsWith('drop')) hasPeer = false
        }
      }
      for (const { event, afterMs } of steps) {
        watch(bench.pass(afterMs))
        watch(bench.give(event))
        const phase = bench.session.publicPhase
        if (phase === 'idle' || phase === 'closed' || phase === 'failed') expect(bench.session.deadlineMs).toBeNull()
      }
    }),
    { numRuns: 500 },
  )
})

test('from every walk a wanted connection can still be made', () => {
  fc.assert(
    fc.property(fc.array(fc.constantFrom(...EVENTS), { maxLength: 60 }), (events) => {
      const bench = new Bench()
      bench.give(...events)
      bench.give({ type: 'disconnectWanted' }, ...CONNECT, { type: 'helloHeard' })
      expect(bench.session.publicPhase).toBe('connected')
    }),
    { numRuns: 500 },
  )
})
