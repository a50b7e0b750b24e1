import fc from 'fast-check'
import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest'
import { MosaicError, type PeerInfo, type BidirectionalStore, type ControlEvent, type SendableStore, type StopReport } from '../../src/index'
import { CATALOGUE, entry, greet, link, linked, live, ROBOT, settle, signedIn } from '../bench'
import { FakeRobot, type FakeRobotOptions } from '../fakeRobot'
import type { FakePeerConnection, FakePlatform } from '../fakes'

beforeEach(() => {
  vi.useFakeTimers({ toFake: ['setTimeout', 'clearTimeout', 'setInterval', 'clearInterval', 'performance', 'Date'] })
})

afterEach(() => {
  vi.useRealTimers()
})

const catalogue = {
  hash: 'h9',
  entries: [
    ...CATALOGUE.entries.filter(({ label }) => label !== 'cmd_vel'),
    entry('cmd_vel', {
      dataType: 'json-u2r',
      delivery: 'latest',
      safety: { requires_lease: true, resource: 'motion', timeout_s: 0.3 },
    }),
    entry('gripper', { dataType: 'json-bi', safety: { requires_lease: true, resource: 'arm' } }),
    entry('notes', { dataType: 'json-bi', safety: { requires_lease: false } }),
    entry('horn', { dataType: 'json-u2r', safety: { timeout_s: 1 } }),
  ],
}
const VELOCITY = { robotId: ROBOT, connectorId: 'cmd_vel' }

type Met = Awaited<ReturnType<typeof meet>>

/** Connected to a robot that knows leases and the stop; other operators can join it. */
async function meet(options: FakeRobotOptions & { role?: 'observer' | 'operator' | 'supervisor' } = {}) {
  const bench = await linked({ catalogue })
  const robot = new FakeRobot({ resources: ['motion', 'arm'], nowUs: () => robotUs(bench.platform), ...options })
  const me = robot.greets(bench.peer, { peerId: 'me', sessionId: 's1', name: 'Me', role: options.role ?? 'operator' })
  bench.peer.channel('_mosaic').control('catalogue', { catalogue })
  const { control } = bench.client.connection(ROBOT)
  const events: ControlEvent[] = []
  control.events.subscribe((event) => void events.push(event))
  return { ...bench, robot, me, control, events }
}

/** The robot's clock is far from ours, and ahead. */
function robotUs(platform: FakePlatform): number {
  return Math.round((platform.now() + 500_000) * 1000)
}

/** The two clocks are compared over a path of `oneWayMs`. */
async function compareClocks({ platform, peer }: Met, oneWayMs: number): Promise<void> {
  const t0 = Math.round(platform.now() * 1000)
  await vi.advanceTimersByTimeAsync(oneWayMs)
  const t1 = robotUs(platform)
  await vi.advanceTimersByTimeAsync(oneWayMs)
  peer.channel('_mosaic').control('pong', { t0, t1, t2: t1 })
}

function velocity({ client, peer, robot, me }: Met): SendableStore {
  const store = client.storeManager.getOrCreateStore(VELOCITY) as SendableStore
  peer.channel('cmd_vel').opens()
  robot.watches(me, 'cmd_vel')
  return store
}

/** Another operator at the same robot, on a page of its own. */
async function another(robot: FakeRobot, who: Parameters<FakeRobot['greets']>[1]) {
  const bench = await linked({ catalogue })
  const guest = robot.greets(bench.peer, who)
  bench.peer.channel('_mosaic').control('catalogue', { catalogue })
  const { control } = bench.client.connection(ROBOT)
  const events: ControlEvent[] = []
  control.events.subscribe((event) => void events.push(event))
  return { ...bench, guest, control, events }
}

describe('who is there', () => {
  test('is what the robot says, and which of them is me', async () => {
    const { control, robot } = await meet()
    expect(control.availability.get()).toBe('available')
    expect(control.me.get()).toMatchObject({ peerId: 'me', role: 'operator', isMe: true })
    await another(robot, { peerId: 'eve' })
    expect(control.peers.get().map(({ peerId, isMe }) => [peerId, isMe])).toEqual([['me', true], ['eve', false]])
  })

  test('whoever loses the right to stop, or has it back, is told once to everybody, with who did it', async () => {
    const { control, robot, me, events } = await meet({ role: 'observer' })
    const wanda: PeerInfo = { ...me.info, peerId: 'wanda', name: 'Wanda' }
    const tell = (...peers: PeerInfo[]) => robot.say(me, 'peers', { you: 'me', peers })
    // Who comes without the right lost it before.
    tell(me.info, { ...wanda, mayStop: false, stopRightBy: 'Boss' })
    expect(events).toEqual([])
    tell({ ...me.info, mayStop: false, stopRightBy: 'Boss' }, { ...wanda, stopRightBy: 'Chief' })
    tell({ ...me.info, mayStop: false, stopRightBy: 'Boss' })
    expect(events).toMatchObject([
      { type: 'stopRight', of: { peerId: 'me', isMe: true }, mayStop: false, by: 'Boss' },
      { type: 'stopRight', of: { peerId: 'wanda', isMe: false }, mayStop: true, by: 'Chief' },
    ])
    expect(control.me.get()?.mayStop).toBe(false)
  })

  test('is unknown before the robot has spoken and after the link is lost', async () => {
    const { client, peer } = await linked({ catalogue })
    const { control } = client.connection(ROBOT)
    expect(control.availability.get()).toBe('unknown')
    expect(control.requestLease()).toBe(false)
    const robot = new FakeRobot()
    robot.greets(peer, { peerId: 'me' })
    peer.channel('_mosaic').vanishes()
    expect(control.availability.get()).toBe('unknown')
    expect(control.peers.get()).toEqual([])
    expect(control.me.get()).toBeNull()
  })

  test('of an original robot nothing is to be had, and everything else works as before', async () => {
    const { client, peer } = await linked({ catalogue: null })
    const { control } = client.connection(ROBOT)
    const store = client.storeManager.getOrCreateStore({ ...VELOCITY, dataType: 'json-u2r' }) as SendableStore
    await vi.advanceTimersByTimeAsync(2000)
    expect(control.availability.get()).toBe('unavailable')
    const channel = peer.channel('cmd_vel').opens()
    expect(store.sendBlocked.get()).toBeNull()
    expect(store.sendData('{}')).toBe(true)
    expect(channel.texts()).toEqual(['{}'])
    expect(control.requestLease()).toBe(false)
    expect(control.releaseLease()).toBe(false)
    await expect(control.stop()).resolves.toMatchObject({ phase: 'unavailable' })
  })

  test('that greets too late stays one', async () => {
    const { client, peer } = await linked({ catalogue: null })
    await vi.advanceTimersByTimeAsync(2000)
    new FakeRobot().greets(peer, { peerId: 'me' })
    expect(client.connection(ROBOT).control.availability.get()).toBe('unavailable')
  })

  test('a robot of ours that does not know leases yet takes commands without', async () => {
    const { client, peer } = await linked({ catalogue })
    greet(peer, catalogue)
    const store = client.storeManager.getOrCreateStore(VELOCITY) as SendableStore
    peer.channel('cmd_vel').opens()
    expect(client.connection(ROBOT).control.availability.get()).toBe('unavailable')
    expect(store.sendData('{}')).toBe(true)
  })
})

describe('commands', () => {
  test('without the lease do not leave the page, and the store says why', async () => {
    const met = await meet()
    const store = velocity(met)
    expect(store.sendBlocked.get()).toEqual({ code: 'lease.required' })
    expect(store.sendData('{}')).toBe(false)
    expect(met.robot.commands).toEqual([])
  })

  test('carry the epoch of the lease that is held', async () => {
    const met = await meet()
    const store = velocity(met)
    expect(met.control.requestLease()).toBe(true)
    expect(store.sendBlocked.get()).toBeNull()
    expect(store.sendData('{}')).toBe(true)
    expect(met.robot.commands).toMatchObject([{ isAccepted: true, frame: { epoch: met.robot.epochOf() } }])
  })

  test('go by the resource of their connector', async () => {
    const met = await meet()
    const gripper = met.client.storeManager.getOrCreateStore({ robotId: ROBOT, connectorId: 'gripper' }) as BidirectionalStore
    met.peer.channel('gripper').opens()
    met.robot.watches(met.me, 'gripper', 'arm')
    met.control.requestLease('motion')
    expect(gripper.sendBlocked.get()).toEqual({ code: 'lease.required', message: 'Take control of arm.' })
    met.control.requestLease('arm')
    expect(gripper.sendJson({})).toBe(true)
    expect(met.robot.commands).toMatchObject([{ isAccepted: true, frame: { epoch: met.robot.epochOf('arm') } }])
  })

  test('of a connector without a lease are nobody\'s business', async () => {
    const met = await meet()
    const notes = met.client.storeManager.getOrCreateStore({ robotId: ROBOT, connectorId: 'notes' }) as BidirectionalStore
    met.peer.channel('notes').opens()
    expect(notes.sendBlocked.get()).toBeNull()
    expect(notes.sendData('{}')).toBe(true)
  })

  test('are blocked with the word that fits: held by another, queued, observer, stopped', async () => {
    const met = await meet()
    const store = velocity(met)
    const eve = await another(met.robot, { peerId: 'eve' })
    eve.control.requestLease()
    expect(store.sendBlocked.get()).toEqual({ code: 'lease.not_holder' })
    met.control.requestLease()
    expect(store.sendBlocked.get()).toEqual({ code: 'lease.queued' })
    eve.control.releaseLease()
    expect(store.sendBlocked.get()).toBeNull()
    void eve.control.stop()
    await vi.advanceTimersByTimeAsync(10)
    expect(store.sendBlocked.get()).toEqual({ code: 'safety.stopped' })
    const before = met.robot.commands.length
    expect(store.sendData('{}')).toBe(true)
    expect(met.robot.commands.slice(before)).toMatchObject([{ isAccepted: false }])
  })

  test('of an observer are forbidden', async () => {
    const met = await meet({ role: 'observer' })
    expect(velocity(met).sendBlocked.get()).toEqual({ code: 'lease.forbidden' })
  })

  test('that waited for room when the lease changed are dropped', async () => {
    const met = await meet()
    const store = velocity(met)
    met.control.requestLease()
    const channel = met.peer.channel('cmd_vel')
    channel.bufferedAmount = 100_000
    expect(store.sendData('{"old":1}')).toBe(true)
    met.robot.expires()
    met.control.requestLease()
    expect(store.sendBlocked.get()).toBeNull()
    channel.bufferedAmount = 0
    channel.onbufferedamountlow?.()
    expect(channel.texts()).toEqual([])
    expect(store.sendData('{"new":1}')).toBe(true)
  })

  test('a page that slept sends nothing under the old epoch, and learns that it lost the lease', async () => {
    const met = await meet()
    const store = velocity(met)
    met.control.requestLease()
    // The worker stands still like everything else of a stopped process; the clock does not.
    const { now } = met.platform
    met.platform.now = () => now() + 60_000
    expect(store.sendData('{}')).toBe(false)
    expect(met.robot.commands).toEqual([])
    expect(met.events.at(-1)).toEqual({ type: 'lost', resource: 'motion', code: 'lease.expired' })
    expect(store.sendBlocked.get()).toEqual({ code: 'lease.required' })
    expect(met.control.leases.get().motion?.ended).toEqual({ code: 'lease.expired' })
  })
})

describe('the lease between two operators', () => {
  test('is asked for, answered and handed over', async () => {
    const { robot, control, events } = await meet()
    const eve = await another(robot, { peerId: 'eve', name: 'Eve' })
    control.requestLease('motion', { reason: 'tour' })
    expect(eve.control.leases.get().motion).toMatchObject({ state: 'other', holder: { name: 'Me', isMe: false } })
    eve.control.requestLease('motion', { reason: 'my turn' })
    expect(eve.control.leases.get().motion?.request).toMatchObject({ phase: 'queued', place: 1 })
    expect(events.at(-1)).toMatchObject({ type: 'asked', resource: 'motion', by: { peerId: 'eve', reason: 'my turn' } })
    expect(control.answerLease('motion', 'eve', false, 'in a minute')).toBe(true)
    expect(eve.events.at(-1)).toMatchObject({ type: 'denied', code: 'lease.denied', message: 'in a minute' })
    eve.control.requestLease()
    control.answerLease('motion', 'eve', true)
    expect(eve.control.leases.get().motion).toMatchObject({ isMine: true, epoch: robot.epochOf() })
    expect(control.leases.get().motion).toMatchObject({ state: 'other', epoch: 0, ended: { code: 'lease.handed_over' } })
    expect(events.at(-1)).toMatchObject({ type: 'lost', code: 'lease.handed_over' })
  })

  test('is taken over by a supervisor with a reason, and by nobody else', async () => {
    const { robot, control, events } = await meet()
    control.requestLease()
    const eve = await another(robot, { peerId: 'eve' })
    eve.control.requestLease('motion', { reason: 'now', force: true })
    expect(eve.events.at(-1)).toMatchObject({ type: 'denied', code: 'lease.force_forbidden' })
    const boss = await another(robot, { peerId: 'boss', role: 'supervisor' })
    boss.control.requestLease('motion', { reason: 'smoke', force: true })
    expect(events.at(-1)).toEqual({ type: 'lost', resource: 'motion', code: 'lease.taken_over', message: 'smoke' })
    expect(robot.holder()).toBe('boss')
  })

  test('is kept alive twice a second while held, and not afterwards', async () => {
    const { robot, control, peer } = await meet()
    await live(peer, 1000)
    expect(robot.sentBy('me', 'lease.keep')).toEqual([])
    control.requestLease()
    await live(peer, 2000)
    expect(robot.sentBy('me', 'lease.keep')).toEqual(Array.from({ length: 4 }, () => ({ epochs: { motion: robot.epochOf() } })))
    control.releaseLease()
    await live(peer, 2000)
    expect(robot.sentBy('me', 'lease.keep')).toHaveLength(4)
    expect(robot.holder()).toBeNull()
  })

  test('is given up where the keep-alives no longer leave the page', async () => {
    const { control, peer, events } = await meet()
    control.requestLease()
    peer.channel('_mosaic').bufferedAmount = 2_000_000
    await live(peer, 3000)
    expect(events.at(-1)).toEqual({ type: 'lost', resource: 'motion', code: 'lease.expired' })
  })

  test('a hidden page gives it back after ten seconds', async () => {
    const { robot, control, peer, platform } = await meet()
    control.requestLease()
    platform.visible = false
    platform.happens('visibility')
    await live(peer, 9500)
    expect(robot.holder()).toBe('me')
    await live(peer, 1000)
    expect(robot.holder()).toBeNull()
  })

  test('a request that the robot does not consider is denied, a command that it refuses is not the desk\'s business', async () => {
    const { robot, me, control, events } = await meet()
    me.isSilenced = true
    control.requestLease()
    me.isSilenced = false
    robot.say(me, 'refusal', { label: 'cmd_vel', code: 'safety.stale' })
    expect(control.leases.get().motion?.request).toMatchObject({ phase: 'asked' })
    robot.say(me, 'refusal', { label: '_mosaic', code: 'signal.too_slow' })
    expect(events.at(-1)).toEqual({ type: 'denied', resource: 'motion', code: 'signal.too_slow' })
  })

  test('reasons longer than the wire takes are cut, not refused', async () => {
    const { robot, control } = await meet()
    control.requestLease('motion', { reason: '🤖'.repeat(300) })
    expect(Array.from(robot.sentBy('me', 'lease.request')[0]?.reason as string)).toHaveLength(200)
  })

  test('views keep their identity while they say the same', async () => {
    const { robot, control, peer } = await meet()
    control.requestLease()
    const { arm, motion } = control.leases.get()
    const seen = vi.fn()
    control.leases.subscribe(seen)
    await live(peer, 2000)
    expect(seen).not.toHaveBeenCalled()
    robot.expires()
    expect(control.leases.get().arm).toBe(arm)
    expect(control.leases.get().motion).not.toBe(motion)
  })
})

describe('a lost link', () => {
  async function lostAndBack(met: Met, joined: Parameters<FakeRobot['greets']>[1], awayMs = 500): Promise<FakePeerConnection> {
    met.peer.channel('_mosaic').vanishes()
    met.robot.loses(met.me)
    await vi.advanceTimersByTimeAsync(awayMs)
    const peer = await link(met.platform)
    met.robot.greets(peer, joined)
    peer.channel('_mosaic').control('catalogue', { catalogue })
    return peer
  }

  test('takes the lease along: the same session asks again by itself and commands under the new epoch', async () => {
    const met = await meet()
    const store = velocity(met)
    met.control.requestLease()
    const before = met.robot.epochOf()
    const peer = await lostAndBack(met, { peerId: 'me-2', sessionId: 's1' })
    expect(met.robot.holder()).toBe('me-2')
    expect(met.control.leases.get().motion).toMatchObject({ isMine: true, epoch: met.robot.epochOf() })
    expect(met.robot.epochOf()).not.toBe(before)
    peer.channel('cmd_vel').opens()
    expect(store.sendData('{}')).toBe(true)
  })

  test('blocks every command until then', async () => {
    const met = await meet()
    const store = velocity(met)
    met.control.requestLease()
    met.peer.channel('_mosaic').vanishes()
    expect(store.sendBlocked.get()).toEqual({ code: 'lease.required' })
    expect(store.sendData('{}')).toBe(false)
  })

  test('does not ask for what was given back', async () => {
    const met = await meet()
    met.control.requestLease()
    met.control.releaseLease()
    await lostAndBack(met, { peerId: 'me-2', sessionId: 's1' })
    expect(met.robot.sentBy('me-2', 'lease.request')).toEqual([])
  })

  test('that another page of the session caused is told, once', async () => {
    const met = await meet()
    met.control.requestLease()
    met.peer.channel('_mosaic').control('bye', { code: 'peer.replaced' })
    expect(met.events.filter(({ type }) => type === 'lost')).toEqual([{ type: 'lost', resource: 'motion', code: 'peer.replaced' }])
  })

  test('by leaving the page ends the lease at once, and coming back does not take it', async () => {
    const met = await meet()
    met.control.requestLease()
    met.platform.happens('hide')
    expect(met.peer.channel('_mosaic').controlSent().at(-1)?.type).toBe('bye')
    met.robot.loses(met.me, true)
    met.platform.happens('show')
    const peer = await link(met.platform)
    met.robot.greets(peer, { peerId: 'me-2', sessionId: 's1' })
    expect(met.robot.holder()).toBeNull()
    expect(met.events.filter(({ type }) => type === 'lost')).toEqual([])
  })

  test('disconnecting while it waits forgets the wish', async () => {
    const met = await meet()
    met.control.requestLease()
    met.peer.channel('_mosaic').vanishes()
    met.client.connection(ROBOT).disconnect()
    met.client.connection(ROBOT).connect()
    const peer = await link(met.platform)
    met.robot.loses(met.me, true)
    met.robot.greets(peer, { peerId: 'me-2', sessionId: 's1' })
    expect(met.robot.sentBy('me-2', 'lease.request')).toEqual([])
  })
})

describe('the stop', () => {
  test('has a channel of its own in the first offer', async () => {
    const { client, platform } = await signedIn()
    client.connection(ROBOT).connect()
    await settle()
    expect(platform.peer.channel('_stop').options).toEqual({ ordered: false, maxRetransmits: 0, protocol: 'mosaic.1' })
  })

  test('is the channel on which pings of the robot are answered, too', async () => {
    const { peer } = await meet()
    const stops = peer.channel('_stop')
    stops.sent.length = peer.channel('_mosaic').sent.length = 0
    stops.control('ping', { t0: 77 })
    expect(stops.controlSent()).toMatchObject([{ type: 'pong', data: { t0: 77 } }])
    expect(peer.channel('_mosaic').controlSent()).toEqual([])
  })

  test('leaves on both channels before the call returns', async () => {
    const { control, peer } = await meet()
    peer.channel('_mosaic').sent.length = 0
    void control.stop('smoke')
    const [onChannel] = peer.channel('_stop').controlSent()
    expect(onChannel).toMatchObject({ type: 'stop', data: { reason: 'smoke' } })
    expect(peer.channel('_mosaic').controlSent()).toEqual([onChannel])
  })

  test('is said again every 30 ms until it is acknowledged, always with the same id, and then no more', async () => {
    const { control, robot } = await meet()
    robot.safeUs = null
    const outcome = control.stop()
    await vi.advanceTimersByTimeAsync(299)
    const onChannel = robot.stopsHeard.filter(({ channel }) => channel === '_stop')
    expect(onChannel).toHaveLength(10)
    expect(new Set(robot.stopsHeard.map(({ id }) => id)).size).toBe(1)
    robot.safeUs = 12_000
    await vi.advanceTimersByTimeAsync(60)
    await expect(outcome).resolves.toMatchObject({ phase: 'safe' })
    const count = robot.stopsHeard.length
    await vi.advanceTimersByTimeAsync(1000)
    expect(robot.stopsHeard).toHaveLength(count)
    expect(robot.stopsHeard.filter(({ channel }) => channel === '_mosaic')).toHaveLength(1)
  })

  test('is measured: to the robot, back here, and until the robot stood', async () => {
    const met = await meet({ latencyMs: 40 })
    await compareClocks(met, 10)
    met.robot.safeUs = 12_000
    const progress: (StopReport | null)[] = []
    met.control.stopState.subscribe(() => void progress.push(met.control.stopState.get().mine))
    const report = await withTime(met.control.stop(), 200)
    expect(report.acknowledgedMs).toBeCloseTo(80, 0)
    expect(report.receivedMs).toBeCloseTo(40, 0)
    expect(report.safeMs).toBeCloseTo(52, 0)
    expect(progress.map((one) => one?.phase)).toContain('sending')
    expect(met.control.stopState.get().mine).toEqual(report)
  })

  test('without compared clocks has the round trip only', async () => {
    const { control } = await meet()
    expect(await withTime(control.stop(), 100)).toMatchObject({ phase: 'safe', acknowledgedMs: 10, receivedMs: null, safeMs: null })
  })

  test('that is acknowledged but not safe is asked about for two seconds', async () => {
    const { control, robot } = await meet()
    robot.safeUs = undefined
    const report = await withTime(control.stop(), 2100)
    expect(report.phase).toBe('acknowledged')
    const count = robot.stopsHeard.length
    expect(count).toBeGreaterThan(60)
    await vi.advanceTimersByTimeAsync(1000)
    expect(robot.stopsHeard).toHaveLength(count)
  })

  test('said again while it is under way is the same stop, sent once more at once', async () => {
    const { control, robot, peer } = await meet()
    robot.safeUs = null
    const first = control.stop()
    peer.channel('_stop').sent.length = 0
    expect(control.stop('again')).toBe(first)
    expect(peer.channel('_stop').sent).toHaveLength(1)
    robot.safeUs = 0
    await withTime(first, 100)
    const second = await withTime(control.stop(), 100)
    expect(second.id).not.toBe((await first).id)
  })

  test('goes on over a new link until it is acknowledged', async () => {
    const met = await meet()
    met.robot.safeUs = null
    const outcome = met.control.stop('smoke')
    met.peer.channel('_mosaic').vanishes()
    met.robot.loses(met.me)
    await vi.advanceTimersByTimeAsync(600)
    const peer = await link(met.platform)
    const said = [...peer.channel('_stop').controlSent(), ...peer.channel('_mosaic').controlSent()]
    expect(said.filter(({ type }) => type === 'stop').length).toBeGreaterThanOrEqual(2)
    met.robot.safeUs = 0
    met.robot.greets(peer, { peerId: 'me-2', sessionId: 's1' })
    expect((await withTime(outcome, 100)).phase).toBe('safe')
    expect(new Set(met.robot.stopsHeard.map(({ id }) => id)).size).toBe(1)
  })

  test('works where the robot knows no stop channel', async () => {
    const { control, robot, peer } = await meet()
    peer.channel('_stop').vanishes()
    expect((await withTime(control.stop(), 100)).phase).toBe('safe')
    expect(robot.stopsHeard).toHaveLength(1)
  })

  test('that nobody can hear says so', async () => {
    const { client } = await signedIn({ catalogue })
    const { control } = client.connection(ROBOT)
    await expect(control.stop()).resolves.toMatchObject({ phase: 'unconfirmed', copies: 0 })
    const met = await meet()
    met.robot.safeUs = null
    const outcome = met.control.stop()
    met.client.connection(ROBOT).disconnect()
    await expect(outcome).resolves.toMatchObject({ phase: 'unconfirmed', copies: 1 })
  })

  test('shows for everybody, and is cleared by the holder of a lease', async () => {
    const met = await meet()
    const eve = await another(met.robot, { peerId: 'eve', name: 'Eve', role: 'observer' })
    await withTime(eve.control.stop('a child'), 100)
    expect(met.control.stopState.get()).toMatchObject({ isStopped: true, by: 'Eve', reason: 'a child', mine: null })
    expect(met.events.at(-1)).toEqual({ type: 'stopped', by: 'Eve', reason: 'a child' })
    await expect(eve.control.clearStop()).resolves.toEqual({ isCleared: false, code: 'lease.required' })
    met.control.requestLease()
    await expect(met.control.clearStop()).resolves.toEqual({ isCleared: true })
    expect(eve.control.stopState.get()).toMatchObject({ isStopped: false, mine: { phase: 'safe' } })
    expect(met.events.at(-1)).toEqual({ type: 'cleared' })
  })

  test('that the robot does not answer to clear is reported', async () => {
    const { control, me, peer } = await meet()
    await withTime(control.stop(), 100)
    me.isSilenced = true
    const cleared = control.clearStop()
    expect(control.clearStop()).toBe(cleared)
    await live(peer, 5000)
    await expect(cleared).resolves.toEqual({ isCleared: false, code: 'signal.timeout' })
  })

  test('of mine is not taken for cleared before the robot has told that it stands', async () => {
    const { control, robot, me } = await meet()
    const toldLater: (() => void)[] = []
    const say = robot.say.bind(robot)
    const slow = vi.spyOn(robot, 'say').mockImplementation((guest, type, data) => void toldLater.push(() => say(guest, type, data)))
    const report = await withTime(control.stop(), 100)
    expect(report.phase).toBe('safe')
    expect(control.stopState.get().isStopped).toBe(false)
    const cleared = control.clearStop()
    expect(robot.sentBy('me', 'stop.clear')).toHaveLength(1)
    for (const tell of toldLater) tell()
    await expect(cleared).resolves.toEqual({ isCleared: false, code: 'lease.required' })
    expect(robot.isStopped).toBe(true)

    slow.mockRestore()
    me.info.role = 'supervisor'
    await expect(control.clearStop()).resolves.toEqual({ isCleared: true })
    const asked = robot.sentBy('me', 'stop.clear').length
    await expect(control.clearStop()).resolves.toEqual({ isCleared: true })
    expect(robot.sentBy('me', 'stop.clear')).toHaveLength(asked)
  })

  test('that is not there needs no clearing', async () => {
    const { control, robot } = await meet()
    await expect(control.clearStop()).resolves.toEqual({ isCleared: true })
    expect(robot.sentBy('me', 'stop.clear')).toEqual([])
  })

  test('is not acknowledged by the answer to another', async () => {
    const { control, robot, peer } = await meet()
    robot.safeUs = null
    const outcome = control.stop()
    peer.channel('_stop').control('stop.ack', { id: 'other', receivedUs: 1, safeUs: 1 })
    expect(control.stopState.get().mine?.phase).toBe('sending')
    const count = robot.stopsHeard.length
    robot.safeUs = 0
    await withTime(outcome, 100)
    expect(robot.stopsHeard.length).toBeGreaterThan(count)
  })

  test('an answer to another stop, or after the end, changes nothing', async () => {
    const { control, peer } = await meet()
    const report = await withTime(control.stop(), 100)
    for (const id of [report.id, 'other']) peer.channel('_stop').control('stop.ack', { id, receivedUs: 1 })
    expect(control.stopState.get().mine).toEqual(report)
  })
})

describe('limits', () => {
  const causes = [{ cause: 'rtt' as const, value: 320, factor: 0.6 }]

  test('show by label while I command', async () => {
    const { control, robot, me } = await meet()
    control.requestLease()
    robot.say(me, 'safety.limit', { label: 'cmd_vel', factor: 0.6, causes })
    expect(control.limits.get().cmd_vel).toEqual({ label: 'cmd_vel', factor: 0.6, causes })
    robot.expires()
    expect(control.limits.get()).toEqual({})
  })

  test('of another resource stay', async () => {
    const { control, robot, me } = await meet()
    control.requestLease()
    control.requestLease('arm')
    robot.say(me, 'safety.limit', { label: 'gripper', factor: 1, causes: [] })
    control.releaseLease('motion')
    expect(Object.keys(control.limits.get())).toEqual(['gripper'])
  })
})

describe('the journal', () => {
  const entries = [{ number: 2, at: '2026-01-01T00:00:00Z', what: 'lease', who: 'me', subject: 'motion', code: '', message: '' }]

  test('is read by supervisors', async () => {
    const { control, robot } = await meet({ role: 'supervisor' })
    robot.journal = entries
    await expect(control.readJournal(500, 7)).resolves.toEqual(entries)
    expect(robot.sentBy('me', 'journal.read')).toEqual([{ limit: 200, before: 7 }])
  })

  test('is closed to others', async () => {
    const { control } = await meet()
    await expect(control.readJournal()).rejects.toMatchObject({ code: 'auth.forbidden' })
  })

  test('asked twice is answered in turn', async () => {
    const { control, robot, me } = await meet({ role: 'supervisor' })
    me.isSilenced = true
    const both = [control.readJournal(1), control.readJournal(2)]
    expect(robot.sentBy('me', 'journal.read')).toEqual([{ limit: 1 }])
    me.isSilenced = false
    robot.say(me, 'journal', { entries })
    await expect(Promise.all(both)).resolves.toEqual([entries, []])
  })

  test('fails where the robot falls silent, or the link is lost', async () => {
    const { control, me, peer } = await meet({ role: 'supervisor' })
    me.isSilenced = true
    const asked = control.readJournal().catch((error: unknown) => error)
    await live(peer, 5000)
    expect(await asked).toBeInstanceOf(MosaicError)
    expect(await asked).toMatchObject({ code: 'signal.timeout' })
    const again = control.readJournal().catch((error: unknown) => error)
    peer.channel('_mosaic').vanishes()
    expect(await again).toMatchObject({ code: 'peer.lost' })
    await expect(control.readJournal()).rejects.toMatchObject({ code: 'peer.lost' })
  })
})

test('nothing that a robot says breaks the desk or lets a command out without a lease', async () => {
  const warn = vi.spyOn(console, 'warn').mockImplementation(() => {})
  const met = await meet()
  const store = velocity(met)
  const types = ['peers', 'lease.reply', 'lease.state', 'stop.ack', 'stop.state', 'safety.limit', 'journal', 'refusal']
  const junk = fc.record({ type: fc.constantFrom(...types), data: fc.jsonValue() })
  const near = fc.record({
    type: fc.constantFrom('lease.reply', 'lease.state', 'peers'),
    data: fc.record({
      resource: fc.constantFrom('motion', 'x', 7, 'NOT A NAME'),
      outcome: fc.constantFrom('queued', 'denied', 'ended', 'granted', 'won'),
      epoch: fc.constantFrom(0, 1, -1, 2 ** 32, 1.5, '7'),
      expiryS: fc.constantFrom(2, 0, -1),
      holder: fc.constantFrom(null, { peerId: 'me' }, { peerId: 7 }),
      you: fc.constantFrom('me', ''),
    }),
  })
  fc.assert(
    fc.property(fc.array(fc.oneof(junk, near)), fc.constantFrom('_mosaic', '_stop'), (messages, label) => {
      for (const message of messages) met.peer.channel(label).says(JSON.stringify(message))
      // Nobody asked for a lease, so nothing can have granted one.
      expect(store.sendData('{}')).toBe(false)
    }),
  )
  expect(met.robot.commands).toEqual([])
  warn.mockRestore()
})

/** The result of something that needs up to `ms` of the fake clock. */
async function withTime<T>(promise: Promise<T>, ms: number): Promise<T> {
  await vi.advanceTimersByTimeAsync(ms)
  return promise
}
