import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest'
import {
  ConnectionCheckingStore,
  SendableStore,
  type BidirectionalStore,
  type MediaStreamStore,
  type MessageInfo,
  type ReceivableStore,
} from '../src/index'
import { CATALOGUE, entry, greet, greeted, link, linked, live, ROBOT, settle, signedIn } from './bench'
import { Refused, type FakePeerConnection, type FakePlatform } from './fakes'

beforeEach(() => {
  vi.useFakeTimers({ toFake: ['setTimeout', 'clearTimeout', 'setInterval', 'clearInterval', 'performance', 'Date'] })
})

afterEach(() => {
  vi.useRealTimers()
})

const connector = (connectorId: string, dataType?: 'json-r2u' | 'json-u2r' | 'json-bi' | 'media') =>
  dataType === undefined ? { robotId: ROBOT, connectorId } : { robotId: ROBOT, connectorId, dataType }

/** A ping that took no time, at this moment of the robot's clock. */
function compareClocks(peer: FakePeerConnection, platform: FakePlatform, robotUs: number): void {
  const t0 = Math.round(platform.now() * 1000)
  peer.channel('_mosaic').control('pong', { t0, t1: robotUs, t2: robotUs })
}

describe('the offer', () => {
  test('has the control channel and one line per media label, in catalogue order', async () => {
    const { platform, client } = await signedIn()
    client.connection(ROBOT).connect()
    await settle()
    const control = platform.peer.channel('_mosaic')
    expect(control.options).toEqual({ ordered: true, protocol: 'mosaic.1' })
    expect(platform.peer.transceivers.map(({ kind, init }) => [kind, init.direction])).toEqual([
      ['video', 'recvonly'],
      ['video', 'recvonly'],
    ])
    expect(platform.socket.sentOf('signaling.send_sdp_offer')).toEqual([
      { rtcConnectionId: 'c1', sdpOffer: 'offer-sdp', tracks: { 0: 'front', 1: 'rear' } },
    ])
  })

  test('uses the ICE servers of the server, in the spelling of browsers', async () => {
    const { peer } = await linked()
    expect(peer.configuration.iceServers).toEqual([
      { urls: ['turn:turn.example.org:3478'], username: 'u', credential: 'c' },
    ])
  })

  test('leaves out ICE servers that make browsers refuse the whole connection', async () => {
    const bench = await signedIn()
    bench.platform.routes['GET /api/v1/webrtc/ice-servers'] = () => [
      { urls: ['stun:stun.example.org', 'turn:turn.example.org'] },
      { urls: 'turns:turn.example.org', username: '', credential: 'c' },
      { urls: 'no address', username: 'u', credential: 'c' },
    ]
    bench.client.connection(ROBOT).connect()
    const peer = await link(bench.platform)
    expect(peer.configuration.iceServers).toEqual([{ urls: ['stun:stun.example.org'] }])
    expect(bench.client.connection(ROBOT).state.get().phase).toBe('connected')
  })

  test('toward an original server has exactly its keys and two blind lines', async () => {
    const { platform } = await linked({ catalogue: null })
    expect(platform.peer.transceivers).toHaveLength(2)
    expect(platform.socket.sentOf('signaling.send_sdp_offer')).toEqual([{ rtcConnectionId: 'c1', sdpOffer: 'offer-sdp' }])
  })

  test('waits for the socket instead of asking a server that would refuse', async () => {
    const { platform, client } = await signedIn()
    platform.socket.onclose?.({ code: 1006 })
    client.connection(ROBOT).connect()
    await settle()
    expect(platform.requests.filter(({ method }) => method === 'POST')).toHaveLength(1)
    await vi.advanceTimersByTimeAsync(500)
    platform.socket.online()
    await settle()
    expect(platform.socket.sentOf('signaling.send_sdp_offer')).toHaveLength(1)
  })
})

describe('candidates', () => {
  test('of ours have exactly three keys; "no more" is not said', async () => {
    const { platform, client } = await signedIn()
    client.connection(ROBOT).connect()
    await settle()
    platform.peer.finds('candidate:1')
    platform.peer.finds('')
    expect(platform.socket.sentOf('signaling.exchange_ice_candidate')).toEqual([
      { rtcConnectionId: 'c1', iceCandidate: { candidate: 'candidate:1', sdpMid: '0', sdpMLineIndex: 0 } },
    ])
  })

  test('of ours wait for the answer of a robot that may be an original one', async () => {
    const { platform, client } = await signedIn({ catalogue: null })
    client.connection(ROBOT).connect()
    await settle()
    platform.peer.finds('candidate:1')
    expect(platform.socket.sentOf('signaling.exchange_ice_candidate')).toEqual([])
    platform.socket.says('signaling.send_sdp_answer', { rtcConnectionId: 'c1', sdpAnswer: 'a' })
    await settle()
    expect(platform.socket.sentOf('signaling.exchange_ice_candidate')).toHaveLength(1)
  })

  test('of the robot wait until its answer is applied', async () => {
    const { platform, client } = await signedIn()
    client.connection(ROBOT).connect()
    await settle()
    const iceCandidate = { candidate: 'candidate:9', sdpMid: '0', sdpMLineIndex: 0 }
    platform.socket.says('signaling.exchange_ice_candidate', { rtcConnectionId: 'c1', iceCandidate })
    await settle()
    expect(platform.peer.candidates).toEqual([])
    platform.socket.says('signaling.send_sdp_answer', { rtcConnectionId: 'c1', sdpAnswer: 'a' })
    await settle()
    expect(platform.peer.candidates).toEqual([iceCandidate])
  })

  test('of somebody else are none of our business', async () => {
    const { platform, peer } = await linked()
    const iceCandidate = { candidate: 'candidate:9', sdpMid: '0', sdpMLineIndex: 0 }
    platform.socket.says('signaling.exchange_ice_candidate', { rtcConnectionId: 'other', iceCandidate })
    await settle()
    expect(peer.candidates).toEqual([])
  })
})

describe('the control channel', () => {
  test('starts with hello, then pings', async () => {
    const { client, peer } = await greeted()
    const control = peer.channel('_mosaic')
    expect(control.controlSent().map(({ type }) => type)).toEqual(['hello', 'resume', 'ping'])
    expect(client.connection(ROBOT).state.get().phase).toBe('connected')
    await live(peer, 1000)
    expect(control.controlSent().filter(({ type }) => type === 'ping').length).toBeGreaterThanOrEqual(2)
  })

  test('measures the round trip', async () => {
    const { platform, client, peer } = await greeted()
    const control = peer.channel('_mosaic')
    const t0 = Math.round(platform.now() * 1000)
    await vi.advanceTimersByTimeAsync(20)
    control.control('pong', { t0, t1: 5_000_000, t2: 5_000_000 })
    expect(client.connection(ROBOT).state.get().roundTripMs).toBeCloseTo(20)
  })

  test('answers the robot\'s pings', async () => {
    const { peer } = await greeted()
    const control = peer.channel('_mosaic')
    control.sent.length = 0
    control.control('ping', { t0: 77 })
    expect(control.controlSent()).toMatchObject([{ type: 'pong', data: { t0: 77 } }])
  })

  test('brings the full catalogue', async () => {
    const { client, peer } = await greeted()
    const full = { hash: 'h1', entries: [entry('battery', { messageSchema: { type: 'object' } })] }
    peer.channel('_mosaic').control('catalogue', { catalogue: full })
    expect(client.connection(ROBOT).catalogue.get()).toEqual(full)
  })

  test('an unreadable message is reported and disturbs nothing', async () => {
    const warn = vi.spyOn(console, 'warn').mockImplementation(() => {})
    const { client, peer } = await greeted()
    peer.channel('_mosaic').says('nonsense')
    peer.channel('_mosaic').says('{"type":"telepathy","data":{}}')
    expect(warn).toHaveBeenCalledTimes(1)
    expect(client.connection(ROBOT).state.get().phase).toBe('connected')
    warn.mockRestore()
  })

  test('refusals reach the connection and the store', async () => {
    const { client, peer } = await greeted()
    const store = client.storeManager.getOrCreateStore(connector('cmd_vel')) as SendableStore
    peer.channel('cmd_vel').opens()
    const listener = vi.fn()
    client.connection(ROBOT).refusals.subscribe(listener)
    const refusal = { label: 'cmd_vel', seq: 1, code: 'safety.stale' }
    peer.channel('_mosaic').control('refusal', refusal)
    expect(listener).toHaveBeenCalledWith(refusal)
    expect(store.lastRefusal.get()).toEqual(refusal)
  })
})

describe('a receivable store', () => {
  test('gets its channel with the offer when it is there before', async () => {
    const { platform, client } = await signedIn()
    const store = client.storeManager.getOrCreateStore(connector('battery')) as ReceivableStore
    expect(store.state.get().phase).toBe('waiting')
    client.connection(ROBOT).connect()
    const peer = await link(platform)
    peer.channel('battery').opens()
    expect(peer.channel('battery').options).toEqual({ ordered: true, protocol: 'mosaic.1' })
    expect(store.state.get()).toEqual({ phase: 'open' })
  })

  test('gets its channel at any time later, and hands over messages with number, stamp and age', async () => {
    const { platform, client, peer } = await greeted()
    compareClocks(peer, platform, 9_000_000)
    const store = client.storeManager.getOrCreateStore(connector('battery', 'json-r2u')) as ReceivableStore
    const heard: [string, MessageInfo | undefined][] = []
    store.subscribe((data, info) => void heard.push([new TextDecoder().decode(data), info]))
    const channel = peer.channel('battery').opens()
    await vi.advanceTimersByTimeAsync(30)
    channel.says('{"percent":7}', { stampUs: 9_010_000, latched: true })
    const [[text, info] = []] = heard
    expect(text).toBe('{"percent":7}')
    expect(info).toMatchObject({ seq: 1, stampUs: 9_010_000, latched: true })
    expect(info?.ageMs).toBeCloseTo(20)
    expect(store.latest?.info.seq).toBe(1)
  })

  test('a value latched before the first pong has no age, and its true one as soon as the clocks are compared', async () => {
    const { platform, client, peer } = await greeted()
    const store = client.storeManager.getOrCreateStore(connector('battery', 'json-r2u')) as ReceivableStore
    const heard: MessageInfo[] = []
    peer.channel('battery').opens().says('1', { stampUs: 7_000_000, latched: true })
    store.subscribe((_data, info) => {
      if (info) heard.push(info)
    })
    await settle()
    expect([store.latest?.info.ageMs, heard[0]?.ageMs]).toEqual([null, null])
    expect(heard[0]?.latched).toBe(true)
    compareClocks(peer, platform, 30_000_000)
    expect(store.latest?.info.ageMs).toBeCloseTo(23_000)
    expect(heard[0]?.ageMs).toBeCloseTo(23_000)
  })

  test('after a reconnect each value is measured by the clocks of its own connection', async () => {
    const { platform, client, peer } = await greeted()
    const store = client.storeManager.getOrCreateStore(connector('battery', 'json-r2u')) as ReceivableStore
    compareClocks(peer, platform, 30_000_000)
    peer.channel('battery').opens().says('1', { stampUs: 29_990_000 })
    const before = store.latest?.info
    peer.channel('_mosaic').vanishes()
    expect(before?.ageMs).toBeCloseTo(10)
    await vi.advanceTimersByTimeAsync(500)
    const again = await link(platform)
    greet(again)
    // The robot has restarted: its clock began anew.
    again.channel('battery').opens().says('2', { stampUs: 1_000_000, latched: true })
    expect(store.latest?.info).toMatchObject({ stampUs: 1_000_000, ageMs: null })
    compareClocks(again, platform, 6_000_000)
    expect(store.latest?.info.ageMs).toBeCloseTo(5000)
    expect(before?.ageMs).toBeCloseTo(10)
  })

  test('a later subscriber is first given the last message', async () => {
    const { client, peer } = await greeted()
    const store = client.storeManager.getOrCreateStore(connector('battery')) as ReceivableStore
    peer.channel('battery').opens().says('1')
    const listener = vi.fn()
    const unsubscribe = store.subscribe(listener)
    expect(listener).not.toHaveBeenCalled()
    await settle()
    expect(listener).toHaveBeenCalledTimes(1)
    expect(listener.mock.calls[0]?.[1]).toMatchObject({ latched: true })
    unsubscribe()
    peer.channel('battery').says('2')
    expect(listener).toHaveBeenCalledTimes(1)
  })

  test('a label that the robot does not have is a mismatch with the nearest name', async () => {
    const { client } = await greeted()
    const store = client.storeManager.getOrCreateStore(connector('batery', 'json-r2u'))
    expect(store.state.get()).toEqual({
      phase: 'mismatch',
      code: 'channel.unknown_label',
      message: "the robot has no connector 'batery'; did you mean 'battery'?",
      nearest: 'battery',
    })
  })

  test('the wrong way round is a mismatch too', async () => {
    const { client } = await greeted()
    const store = client.storeManager.getOrCreateStore(connector('battery', 'json-u2r'))
    expect(store.state.get()).toMatchObject({ phase: 'mismatch', message: expect.stringContaining('json-r2u') as string })
  })

  test('a mismatch heals when the robot learns the label', async () => {
    const { client, peer } = await greeted()
    const store = client.storeManager.getOrCreateStore(connector('sonar', 'json-r2u'))
    expect(store.state.get().phase).toBe('mismatch')
    const catalogue = { hash: 'h2', entries: [...CATALOGUE.entries, entry('sonar')] }
    peer.channel('_mosaic').control('catalogue', { catalogue })
    peer.channel('sonar').opens()
    expect(store.state.get().phase).toBe('open')
  })

  test('closes when the robot takes its connector away, and is open again when that is back', async () => {
    const { client, peer } = await greeted()
    const store = client.storeManager.getOrCreateStore(connector('battery'))
    const first = peer.channel('battery').opens()
    const entries = CATALOGUE.entries.filter(({ label }) => label !== 'battery')
    peer.channel('_mosaic').control('catalogue', { catalogue: { hash: 'h2', entries } })
    expect(store.state.get().phase).toBe('mismatch')
    expect(first.readyState).toBe('closed')
    peer.channel('_mosaic').control('catalogue', { catalogue: CATALOGUE })
    peer.channel('battery').opens()
    expect(store.state.get()).toEqual({ phase: 'open' })
  })

  test('is opened anew when the robot delivers it otherwise, and only then', async () => {
    const { client, peer } = await greeted()
    const store = client.storeManager.getOrCreateStore(connector('battery'))
    const first = peer.channel('battery').opens()
    const described = CATALOGUE.entries.map((one) => (one.label === 'battery' ? { ...one, widget: 'gauge' } : one))
    peer.channel('_mosaic').control('catalogue', { catalogue: { hash: 'h2', entries: described } })
    expect(first.readyState).toBe('open')
    const otherwise = described.map((one) => (one.label === 'battery' ? { ...one, delivery: 'latest' as const } : one))
    peer.channel('_mosaic').control('catalogue', { catalogue: { hash: 'h3', entries: otherwise } })
    expect(first.readyState).toBe('closed')
    expect(peer.channel('battery').options).toEqual({ ordered: false, maxRetransmits: 0, protocol: 'mosaic.1' })
    peer.channel('battery').opens()
    expect(store.state.get()).toEqual({ phase: 'open' })
  })

  test('closes its channel a second after the last release', async () => {
    const { client, peer } = await greeted()
    client.storeManager.getOrCreateStore(connector('battery'))
    const channel = peer.channel('battery').opens()
    client.storeManager.releaseStore(connector('battery'))
    await live(peer, 750)
    expect(channel.readyState).toBe('open')
    await live(peer, 500)
    expect(channel.readyState).toBe('closed')
  })

  test('says so when the robot closes the channel', async () => {
    const { client, peer } = await greeted()
    const store = client.storeManager.getOrCreateStore(connector('battery'))
    peer.channel('battery').opens().vanishes()
    expect(store.state.get()).toEqual({ phase: 'closed', code: 'peer.closed' })
  })
})

describe('a sendable store', () => {
  test('sends frames on a channel as the catalogue wants it', async () => {
    const { client, peer } = await greeted()
    const store = client.storeManager.getOrCreateStore(connector('cmd_vel')) as SendableStore
    expect(store).toBeInstanceOf(SendableStore)
    expect(store.sendData('{}')).toBe(false)
    const channel = peer.channel('cmd_vel').opens()
    expect(channel.options).toEqual({ ordered: false, maxRetransmits: 0, protocol: 'mosaic.1' })
    expect(store.sendData('{"linear":{"x":1}}')).toBe(true)
    expect(store.sendJson({ linear: { x: NaN } })).toBe(false)
    expect(channel.texts()).toEqual(['{"linear":{"x":1}}'])
  })

  test('of delivery latest keeps one waiting value while the link does not keep up', async () => {
    const { client, peer } = await greeted()
    const store = client.storeManager.getOrCreateStore(connector('cmd_vel')) as SendableStore
    const channel = peer.channel('cmd_vel').opens()
    channel.bufferedAmount = 100_000
    for (const value of ['1', '2', '3']) expect(store.sendData(value)).toBe(true)
    expect(channel.texts()).toEqual([])
    channel.bufferedAmount = 0
    channel.onbufferedamountlow?.()
    expect(channel.texts()).toEqual(['3'])
  })

  test('of delivery reliable is told when the link does not keep up', async () => {
    const catalogue = { hash: 'h', entries: [entry('notes', { dataType: 'json-bi' })] }
    const { client, peer } = await greeted({ catalogue })
    const store = client.storeManager.getOrCreateStore(connector('notes')) as BidirectionalStore
    const channel = peer.channel('notes').opens()
    channel.bufferedAmount = 2_000_000
    expect(store.sendData('1')).toBe(false)
  })
})

describe('a media store', () => {
  test('gets the track of its mid, and the robot is asked for pictures while somebody looks', async () => {
    const { client, platform, peer } = await greeted()
    const control = peer.channel('_mosaic')
    const stream = peer.brings('1', 'rear')
    const store = client.storeManager.getOrCreateStore(connector('rear')) as MediaStreamStore
    expect(store.mediaStream.get()).toBe(stream)
    expect(store.state.get().phase).toBe('open')
    const watches = (): unknown[] => control.controlSent().filter(({ type }) => type === 'media.watch')
    expect(watches()).toEqual([])
    const leave = store.mediaStream.subscribe(() => {})
    expect(watches()).toEqual([{ type: 'media.watch', data: { label: 'rear', on: true } }])
    control.sent.length = 0
    platform.visible = false
    platform.happens('visibility')
    expect(watches()).toEqual([{ type: 'media.watch', data: { label: 'rear', on: false } }])
    platform.visible = true
    control.sent.length = 0
    platform.happens('visibility')
    leave()
    expect(watches().map((watch) => (watch as { data: { on: boolean } }).data.on)).toEqual([true, false])
  })

  test('tells the robot how large its picture is shown, and again when that changes by much', async () => {
    const { client, peer } = await greeted()
    const control = peer.channel('_mosaic')
    peer.brings('1', 'rear')
    const store = client.storeManager.getOrCreateStore(connector('rear')) as MediaStreamStore
    const told = (): unknown[] => control.controlSent().flatMap(({ type, data }) => (type === 'media.watch' ? [data] : []))
    store.setShown({ sizePx: 1000.4, leads: false })
    expect(told()).toEqual([])
    store.mediaStream.subscribe(() => {})
    const first = { label: 'rear', on: true, shownPx: 1000, leads: false }
    expect(told()).toEqual([first])
    store.setShown({ sizePx: 1200, leads: false })
    expect(told()).toEqual([first])
    store.setShown({ sizePx: 4000, leads: false })
    store.setShown({ sizePx: 4000, leads: true })
    expect(told().slice(1)).toEqual([
      { ...first, shownPx: 4000 },
      { ...first, shownPx: 4000, leads: true },
    ])
  })

  test('whose widget was there before the connection is watched as soon as the robot says hello', async () => {
    const { platform, client } = await signedIn()
    const store = client.storeManager.getOrCreateStore(connector('front', 'media')) as MediaStreamStore
    store.mediaStream.subscribe(() => {})
    client.connection(ROBOT).connect()
    await settle()
    platform.peer.brings('0', 'front')
    expect(store.mediaStream.get()).toBeNull()
    const peer = await link(platform)
    expect(store.mediaStream.get()).toEqual({ id: 'front' })
    greet(peer)
    expect(peer.channel('_mosaic').controlSent()).toContainEqual({ type: 'media.watch', data: { label: 'front', on: true } })
  })

  test('made before anybody knew that it is one says what to do', async () => {
    const { platform, client } = await signedIn()
    const store = client.storeManager.getOrCreateStore(connector('front'))
    client.connection(ROBOT).connect()
    await link(platform)
    expect(store.state.get()).toMatchObject({ phase: 'mismatch', message: expect.stringContaining("'media'") as string })
  })

  test('tells why there is no picture', async () => {
    const { client, peer } = await greeted()
    const store = client.storeManager.getOrCreateStore(connector('rear'))
    peer.channel('_mosaic').control('media.unavailable', { label: 'rear', code: 'plugin.failed', message: 'no camera' })
    expect(store.state.get()).toEqual({ phase: 'closed', code: 'plugin.failed', message: 'no camera' })
  })

  test('a track without a stream gets one of its own', async () => {
    const { client, peer } = await greeted()
    peer.brings('0')
    const store = client.storeManager.getOrCreateStore(connector('front')) as MediaStreamStore
    expect(store.mediaStream.get()).toEqual({ id: 'of t' })
  })

  test('knows how old the picture is that is shown', async () => {
    const { client, platform, peer } = await greeted()
    peer.brings('0', 'front')
    const store = client.storeManager.getOrCreateStore(connector('front')) as MediaStreamStore
    expect(store.pictureAgeMs(0, platform.now())).toBeNull()
    const t0 = Math.round(platform.now() * 1000)
    peer.channel('_mosaic').control('pong', { t0, t1: 2_000_000, t2: 2_000_000 })
    const rtpOrigin = 4_294_960_000
    peer.channel('_mosaic').control('media.origin', { label: 'front', ssrc: 1, rtpOrigin, bootId: 'b1' })
    // Captured at 1.9 s of the robot's clock, shown now, at 2.0 s: 100 ms, across the wrap of the RTP clock.
    const captured = (1.9 * 90_000 + rtpOrigin) % 2 ** 32
    expect(store.pictureAgeMs(captured, platform.now())).toBeCloseTo(100, 1)
  })
})

test('a connection-check store measures through its two channels while somebody listens', async () => {
  const { client, peer } = await greeted()
  const store = client.storeManager.getOrCreateStore(connector('link')) as ConnectionCheckingStore
  expect(store).toBeInstanceOf(ConnectionCheckingStore)
  peer.channel('link-receiver').opens()
  expect(store.state.get().phase).toBe('waiting')
  const back = peer.channel('link-sender').opens()
  expect(store.state.get().phase).toBe('open')
  await live(peer, 1000)
  expect(peer.channel('link-receiver').sent).toEqual([])
  const leave = store.roundTripMs.subscribe(() => {})
  const [sent] = peer.channel('link-receiver').texts()
  await vi.advanceTimersByTimeAsync(12)
  back.says(sent ?? '')
  expect(store.roundTripMs.get()).toBeCloseTo(12)
  leave()
  leave()
  const count = peer.channel('link-receiver').sent.length
  await live(peer, 2000)
  expect(peer.channel('link-receiver').sent).toHaveLength(count)
})

describe('an original robot', () => {
  test('gets bare channels after two seconds without a hello', async () => {
    const { client, peer } = await linked({ catalogue: null })
    const store = client.storeManager.getOrCreateStore(connector('pose', 'json-bi')) as BidirectionalStore
    expect(peer.channels.map(({ label }) => label)).toEqual(['_mosaic', '_stop'])
    await vi.advanceTimersByTimeAsync(2000)
    const channel = peer.channel('pose').opens()
    expect(channel.options).toEqual({ ordered: true })
    const listener = vi.fn()
    store.subscribe(listener)
    channel.says('{"x":1}')
    expect(new TextDecoder().decode(listener.mock.calls[0]?.[0] as ArrayBuffer)).toBe('{"x":1}')
    expect(listener.mock.calls[0]?.[1]).toMatchObject({ seq: 0, ageMs: null })
    store.sendData(new TextEncoder().encode('{"y":2}'))
    expect(channel.sent).toEqual(['{"y":2}'])
    await vi.advanceTimersByTimeAsync(60_000)
    expect(client.connection(ROBOT).state.get().phase).toBe('connected')
  })

  test('names its tracks by their streams, and is never asked to send pictures', async () => {
    const { client, peer } = await linked({ catalogue: null })
    const store = client.storeManager.getOrCreateStore(connector('camera', 'media')) as MediaStreamStore
    store.mediaStream.subscribe(() => {})
    await vi.advanceTimersByTimeAsync(2000)
    peer.brings('0', 'camera')
    expect(store.mediaStream.get()).toEqual({ id: 'camera' })
    expect(peer.channel('_mosaic').controlSent().map(({ type }) => type)).toEqual(['hello', 'resume'])
  })

  test('whose catalogue was an old one gets bare channels in place of framed ones', async () => {
    const { client, peer } = await linked()
    client.storeManager.getOrCreateStore(connector('battery'))
    const framed = peer.channel('battery').opens()
    await vi.advanceTimersByTimeAsync(2000)
    expect(framed.readyState).toBe('closed')
    expect(peer.channel('battery').options).toEqual({ ordered: true })
  })
})

describe('a loss', () => {
  test('of two seconds of silence brings a new peer for the same session, and the stores live through it', async () => {
    const { client, platform, peer } = await greeted()
    const store = client.storeManager.getOrCreateStore(connector('battery')) as ReceivableStore
    const events: string[] = []
    store.subscribeLifecycle((event) => void events.push(event))
    peer.channel('battery').opens()
    await vi.advanceTimersByTimeAsync(2000)
    expect(client.connection(ROBOT).state.get()).toMatchObject({ phase: 'reconnecting', code: 'peer.lost' })
    expect(store.state.get()).toEqual({ phase: 'reconnecting', code: 'peer.lost' })
    expect(peer.isClosed).toBe(true)
    await vi.advanceTimersByTimeAsync(500)
    const next = await link(platform)
    expect(next).not.toBe(peer)
    greet(next)
    next.channel('battery').opens()
    expect(store.state.get()).toEqual({ phase: 'open' })
    expect(events).toEqual(['after-connected', 'after-disconnected', 'before-connected', 'after-connected'])
    const bodies = platform.requests.filter(({ path }) => path.endsWith('/connection')).map(({ body }) => body)
    expect(bodies).toEqual([{ robotIds: [ROBOT] }, { robotIds: [ROBOT], sessionId: 's1' }])
  })

  test('learns what the robot announced meanwhile', async () => {
    const { client, platform, peer } = await greeted()
    const catalogue = { hash: 'h2', entries: [entry('sonar')] }
    platform.socket.says('catalogue.update', { robotId: ROBOT, catalogue })
    expect(client.connection(ROBOT).catalogue.get()?.hash).toBe('h1')
    peer.channel('_mosaic').control('bye', { code: 'peer.shutdown' })
    expect(client.connection(ROBOT).catalogue.get()).toEqual(catalogue)
  })

  test('of the server alone touches nothing', async () => {
    const { client, platform, peer } = await greeted()
    platform.socket.onclose?.({ code: 1006 })
    platform.socket.onclose?.({ code: 1006 })
    await live(peer, 3000)
    expect(client.connection(ROBOT).state.get().phase).toBe('connected')
    expect(platform.peers).toHaveLength(1)
  })

  test('waits out the pause unless the robot comes online', async () => {
    const { platform, peer } = await greeted()
    platform.socket.says('status.update', { robotId: ROBOT, status: 5 })
    peer.channel('_mosaic').control('bye', { code: 'peer.shutdown' })
    platform.routes['POST /api/v1/webrtc/connection'] = () => {
      throw new Refused(400, { resultCode: 'ROBOT_WS_SESSION_NOT_EXIST', resultData: null })
    }
    await vi.advanceTimersByTimeAsync(1600)
    const asked = (): number => platform.requests.filter(({ path }) => path.endsWith('/connection')).length
    const before = asked()
    platform.socket.says('status.update', { robotId: ROBOT, status: 0 })
    await settle()
    expect(asked()).toBe(before + 1)
    platform.socket.says('status.update', { robotId: ROBOT, status: 0 })
    await settle()
    expect(asked()).toBe(before + 1)
  })

  test('by the word of the server carries its reason', async () => {
    const { client, platform } = await greeted()
    const reason = { code: 'peer.not_allowed', message: 'no' }
    platform.socket.says('signaling.close_peer_connection', { rtcConnectionId: 'c1', ...reason })
    expect(client.connection(ROBOT).state.get()).toEqual({ phase: 'failed', ...reason, roundTripMs: null })
  })
})

describe('failing', () => {
  test('an answer that the browser refuses has its code', async () => {
    const { client, platform } = await signedIn()
    client.connection(ROBOT).connect()
    await settle()
    platform.peer.rejectsAnswer = true
    platform.socket.says('signaling.send_sdp_answer', { rtcConnectionId: 'c1', sdpAnswer: 'a' })
    await settle()
    expect(client.connection(ROBOT).state.get()).toMatchObject({ phase: 'failed', code: 'sdp.invalid' })
  })

  test('the refusal of the server has its code, and the stores are told', async () => {
    const { client, platform } = await signedIn()
    platform.routes['POST /api/v1/webrtc/connection'] = () => {
      const refusal = { code: 'auth.forbidden', message: 'not yours', cure: 'ask' }
      throw new Refused(403, { resultCode: 'ACCESS_DENIED', resultData: null, ...refusal })
    }
    const store = client.storeManager.getOrCreateStore(connector('battery', 'json-r2u'))
    const events: string[] = []
    store.subscribeLifecycle((event) => void events.push(event))
    client.connection(ROBOT).connect()
    await settle()
    expect(client.connection(ROBOT).state.get()).toMatchObject({ phase: 'failed', code: 'auth.forbidden', message: 'not yours' })
    expect(events).toEqual(['before-connected', 'after-connection-failed'])
  })

  test('what an abandoned attempt still learns changes nothing', async () => {
    const { client, platform } = await signedIn()
    const connection = client.connection(ROBOT)
    connection.connect()
    connection.disconnect()
    await settle()
    expect(platform.peers).toHaveLength(0)
    expect(connection.state.get().phase).toBe('closed')
  })
})

describe('leaving', () => {
  test('says goodbye on both ways and lets it leave before closing', async () => {
    const { client, platform, peer } = await greeted()
    client.connection(ROBOT).disconnect()
    expect(peer.channel('_mosaic').controlSent().at(-1)).toEqual({ type: 'bye', data: { code: 'peer.closed' } })
    expect(platform.socket.sentOf('signaling.close_peer_connection')).toEqual([{ rtcConnectionId: 'c1' }])
    expect(peer.isClosed).toBe(false)
    await vi.advanceTimersByTimeAsync(200)
    expect(peer.isClosed).toBe(true)
  })

  test('the page says goodbye, and a page that comes back connects again', async () => {
    const { client, platform, peer } = await greeted()
    platform.happens('hide')
    expect(peer.channel('_mosaic').controlSent().at(-1)?.type).toBe('bye')
    platform.happens('show')
    await settle()
    expect(platform.peers).toHaveLength(2)
    expect(client.connection(ROBOT).state.get().phase).toBe('reconnecting')
  })
})
