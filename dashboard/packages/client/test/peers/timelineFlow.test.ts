import { afterEach, beforeEach, expect, test, vi } from 'vitest'
import type { ReceivableStore } from '../../src/index'
import { greeted, link, linked, ROBOT, settle, signedIn } from '../bench'

beforeEach(() => {
  vi.useFakeTimers({ toFake: ['setTimeout', 'clearTimeout', 'setInterval', 'clearInterval', 'performance', 'Date'] })
})

afterEach(() => {
  vi.useRealTimers()
})

test('a connection tells each of its moments, up to the first value', async () => {
  const { client, peer } = await greeted()
  const robot = client.connection(ROBOT)
  client.storeManager.getOrCreateStore({ robotId: ROBOT, connectorId: 'battery' }) as ReceivableStore
  const channel = peer.channel('battery')
  channel.onopen?.()
  channel.says('{"percent": 80}')
  const moments = robot.timeline.get()?.marks.map(({ moment }) => moment)
  expect(moments).toEqual(['asked', 'granted', 'offered', 'answered', 'ice', 'dtls', 'control', 'hello', 'catalogue', 'value'])
  expect(robot.failedTimeline.get()).toBeNull()
})

test('a robot that never answers ends the attempt with its code, and the next one begins a new timeline', async () => {
  const { client, platform } = await signedIn()
  const robot = client.connection(ROBOT)
  robot.connect()
  await settle()
  await vi.advanceTimersByTimeAsync(10_000)
  expect(robot.failedTimeline.get()).toMatchObject({ code: 'signal.no_answer' })
  expect(robot.failedTimeline.get()?.marks.map(({ moment }) => moment)).toEqual(['asked', 'granted', 'offered'])
  await vi.advanceTimersByTimeAsync(1_000)
  await link(platform)
  expect(robot.timeline.get()?.endedMs).toBeUndefined()
  expect(robot.failedTimeline.get()).toBeNull()
})

test('what breaks after ICE found a path is DTLS, and before it ICE', async () => {
  const cases = [
    [true, 'dtls.failed'],
    [false, 'ice.failed'],
  ] as const
  for (const [hasPath, code] of cases) {
    const { client, platform } = await signedIn()
    const robot = client.connection(ROBOT)
    robot.connect()
    await settle()
    const { peer } = platform
    if (hasPath) Object.assign(peer, { iceConnectionState: 'connected' })
    if (hasPath) peer.oniceconnectionstatechange?.()
    Object.assign(peer, { connectionState: 'failed' })
    peer.onconnectionstatechange?.()
    expect(robot.state.get().code).toBe(code)
    client.logout()
  }
})

test('nothing is written down of an end on purpose', async () => {
  const { client } = await linked()
  client.connection(ROBOT).disconnect()
  expect(client.connection(ROBOT).failedTimeline.get()).toBeNull()
})
