/** A machine that slept, or a page that stood still: every timer comes late, and what arrived meanwhile lies unread. */
import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest'
import { CONTROL_EXTENSIONS } from '@mosaic/protocol'
import type { ReceivableStore } from '../../src/index'
import { wallClockMs } from '../../src/timing/clock'
import { greet, greeted, link, linked, ROBOT, settle, signedIn } from '../bench'
import { FakeRobot } from '../fakeRobot'
import type { FakePeerConnection, FakePlatform } from '../fakes'

beforeEach(() => {
  vi.useFakeTimers({ toFake: ['setTimeout', 'clearTimeout', 'setInterval', 'clearInterval', 'performance', 'Date'] })
})

afterEach(() => {
  vi.useRealTimers()
})

const HOUR_MS = 3_600_000

/** The robot's word, which was an instant on its way. */
function pong(platform: FakePlatform, peer: FakePeerConnection): void {
  peer.channel('_mosaic').control('pong', { t0: Math.round(platform.now() * 1000), t1: 0, t2: 0 })
}

async function lives(platform: FakePlatform, peer: FakePeerConnection, ms: number): Promise<void> {
  for (let passedMs = 0; passedMs < ms; passedMs += 250) {
    await vi.advanceTimersByTimeAsync(250)
    pong(platform, peer)
  }
}

/** The machine stands still: no timer runs, and the page's clock goes on. */
function standsStill(platform: FakePlatform, ms: number): void {
  const { now } = platform
  platform.now = () => now() + ms
}

/** The lid is closed: no timer runs, and on most systems the page's clock stands still as well. */
function lidIsClosed(ms: number): void {
  vi.setSystemTime(wallClockMs() + ms)
}

describe('a page whose machine slept for an hour, on a clock that counted it', () => {
  test('gives a connected robot one moment to answer, then connects anew, on a new socket', async () => {
    const { platform, client, peer } = await greeted()
    await lives(platform, peer, 1000)
    standsStill(platform, HOUR_MS)
    platform.socket.answers = false
    const socketsBefore = platform.sockets.length
    await vi.advanceTimersByTimeAsync(500)
    expect(client.connection(ROBOT).state.get().phase).toBe('connected')
    await vi.advanceTimersByTimeAsync(1000)
    expect(client.connection(ROBOT).state.get()).toMatchObject({ phase: 'reconnecting', code: 'peer.lost' })
    expect(platform.sockets.length).toBe(socketsBefore + 1)
    platform.socket.online()
    const next = await link(platform)
    greet(next)
    expect(client.connection(ROBOT).state.get().phase).toBe('connected')
  })

  test('keeps a robot that answers, though a question was open when it fell asleep', async () => {
    const { platform, client, peer } = await greeted()
    await vi.advanceTimersByTimeAsync(500)
    standsStill(platform, HOUR_MS)
    // The timer is first: the answers lie unread.
    await vi.advanceTimersByTimeAsync(500)
    pong(platform, peer)
    await lives(platform, peer, 3000)
    expect(client.connection(ROBOT).state.get().phase).toBe('connected')
    expect(platform.peers).toHaveLength(1)
  })

  test('tries again at once where it waited for the next attempt', async () => {
    const { platform, client, peer } = await greeted()
    peer.channel('_mosaic').control('bye', { code: 'peer.shutdown' })
    expect(client.connection(ROBOT).state.get().phase).toBe('reconnecting')
    standsStill(platform, HOUR_MS)
    await vi.advanceTimersByTimeAsync(500)
    greet(await link(platform))
    expect(client.connection(ROBOT).state.get().phase).toBe('connected')
    expect(platform.peers).toHaveLength(2)
  })

  test('gives up what it asked before, and asks once more', async () => {
    const { platform, client } = await signedIn()
    const answers: ((answer: unknown) => void)[] = []
    const route = platform.routes['POST /api/v1/webrtc/connection']
    platform.routes['POST /api/v1/webrtc/connection'] = () => new Promise((resolve) => answers.push(resolve))
    client.connection(ROBOT).connect()
    await settle()
    standsStill(platform, HOUR_MS)
    await vi.advanceTimersByTimeAsync(8000)
    if (route) platform.routes['POST /api/v1/webrtc/connection'] = route
    answers[0]?.({ resultCode: 100, resultData: { sessions: [{ robotId: ROBOT, rtcSessionId: 'of before' }] } })
    await vi.advanceTimersByTimeAsync(500)
    greet(await link(platform))
    expect(client.connection(ROBOT).state.get().phase).toBe('connected')
    expect(platform.socket.sentOf('signaling.send_sdp_offer')).toMatchObject([{ rtcConnectionId: 'c1' }])
  })
})

describe('a page that stood still for some seconds', () => {
  test('reads the hello that was waiting before it takes the robot for an original one', async () => {
    const { platform, client, peer } = await linked()
    standsStill(platform, 5000)
    await vi.advanceTimersByTimeAsync(2000)
    greet(peer)
    expect(peer.channel('_mosaic').controlSent().at(-1)?.type).toBe('ping')
    await vi.advanceTimersByTimeAsync(2000)
    // An original one would never be missed.
    expect(client.connection(ROBOT).state.get().phase).toBe('reconnecting')
  })

  test('reads how far the robot is before it takes its numbers for those of this connection', async () => {
    const { platform, client, peer } = await linked()
    const store = client.storeManager.getOrCreateStore({ robotId: ROBOT, connectorId: 'battery' }) as ReceivableStore
    const channel = peer.channel('battery').opens()
    const control = peer.channel('_mosaic')
    control.control('hello', { protocol: 1, extensions: CONTROL_EXTENSIONS, software: 'x', bootId: 'b1', isPerson: false })
    channel.says('1')
    standsStill(platform, 2600)
    await lives(platform, peer, 2000)
    expect(store.latest).toBeNull()
    control.control('resume', { bootId: 'b1', isNew: false, received: {}, upcoming: { battery: 1 } })
    expect(store.latest?.info.seq).toBe(1)
    expect(client.connection(ROBOT).state.get().phase).toBe('connected')
  })

  test('gives a robot on a slow path the time of its way, however little it has been asked', async () => {
    const { platform, client, peer } = await greeted()
    await lives(platform, peer, 1000)
    await vi.advanceTimersByTimeAsync(500)
    standsStill(platform, 2500)
    await vi.advanceTimersByTimeAsync(900)
    pong(platform, peer)
    await lives(platform, peer, 1000)
    expect(client.connection(ROBOT).state.get().phase).toBe('connected')
  })
})

describe('a page whose lid was closed for an hour, on a clock that stood still', () => {
  test('asks the robot and the server at once instead of waiting for their silence', async () => {
    const { platform, client, peer } = await greeted()
    await lives(platform, peer, 1000)
    lidIsClosed(HOUR_MS)
    platform.socket.answers = false
    const socketsBefore = platform.sockets.length
    await vi.advanceTimersByTimeAsync(1250)
    expect(client.connection(ROBOT).state.get().phase).toBe('reconnecting')
    expect(platform.sockets.length).toBe(socketsBefore + 1)
  })

  test('keeps a robot that answers all the same', async () => {
    const { platform, client, peer } = await greeted()
    await lives(platform, peer, 1000)
    lidIsClosed(HOUR_MS)
    await lives(platform, peer, 5000)
    expect(client.connection(ROBOT).state.get().phase).toBe('connected')
    expect(platform.peers).toHaveLength(1)
  })

  test('does not take control again by itself: that was another sitting', async () => {
    const { platform, client, peer } = await linked()
    const robot = new FakeRobot()
    const me = robot.greets(peer, { peerId: 'me', sessionId: 's1' })
    const { control } = client.connection(ROBOT)
    control.requestLease()
    expect(control.leases.get().motion?.isMine).toBe(true)
    await vi.advanceTimersByTimeAsync(500)
    me.isSilenced = true
    robot.expires()
    robot.loses(me)
    lidIsClosed(HOUR_MS)
    await vi.advanceTimersByTimeAsync(2500)
    expect(client.connection(ROBOT).state.get().phase).toBe('reconnecting')
    platform.socket.online()
    robot.greets(await link(platform), { peerId: 'me-2', sessionId: 's1' })
    await vi.advanceTimersByTimeAsync(500)
    expect(robot.sentBy('me-2', 'lease.request')).toEqual([])
    expect(control.leases.get().motion).toMatchObject({ isMine: false, ended: { code: 'lease.expired' } })
  })

  test('takes a clock that somebody sets back for nothing else', async () => {
    const { platform, client, peer } = await greeted()
    await lives(platform, peer, 1000)
    lidIsClosed(-HOUR_MS)
    await vi.advanceTimersByTimeAsync(1250)
    expect(client.connection(ROBOT).state.get().phase).toBe('connected')
    await lives(platform, peer, 1000)
    expect(platform.peers).toHaveLength(1)
  })
})
