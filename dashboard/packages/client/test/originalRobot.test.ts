/** An original robot, which announces nothing: people described it. */
import type { DescribedConnector } from '@mosaic/protocol'
import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest'
import { ConnectionCheckingStore, MediaStreamStore, type BidirectionalStore, type ReceivableStore, type SendableStore } from '../src/index'
import type { FakeDataChannel } from './fakes'
import { greet, link, linked, ROBOT, settle, signedIn } from './bench'

beforeEach(() => {
  vi.useFakeTimers({ toFake: ['setTimeout', 'clearTimeout', 'setInterval', 'clearInterval', 'performance', 'Date'] })
})

afterEach(() => {
  vi.useRealTimers()
})

const CONNECTORS: readonly DescribedConnector[] = [
  { connectorId: 'front', connectorType: 'opencv-sender-camera' },
  { connectorId: 'scan', connectorType: 'turtlebot-sender-laser-scan' },
  { connectorId: 'teleop', connectorType: 'turtlebot-receiver-teleop' },
  { connectorId: 'L', connectorType: 'connection-check' },
  { connectorId: 'cloud', connectorType: 'ros2-sender-sensor-PointCloud2', params: { parallel_num: '2' } },
]
const described = (connectors: readonly DescribedConnector[] = CONNECTORS) => ({
  catalogue: null,
  connectorConfig: JSON.stringify({ connectors }),
})
const connector = (connectorId: string) => ({ robotId: ROBOT, connectorId })

/** Time passes without a hello. */
async function silence(): Promise<void> {
  await vi.advanceTimersByTimeAsync(2100)
}

describe('its connectors', () => {
  test('are known before there is a connection, from what the server keeps', async () => {
    const { client } = await signedIn(described())
    const catalogue = client.connection(ROBOT).catalogue.get()
    expect(catalogue?.entries.map(({ label }) => label)).toEqual(['front', 'scan', 'teleop', 'L', 'cloud'])
  })

  test('have bare channels at once: nobody waits for a hello, and no label is opened twice', async () => {
    const { client, peer } = await linked(described())
    client.storeManager.getOrCreateStore(connector('scan'))
    const cloud = client.storeManager.getOrCreateStore(connector('cloud')) as ReceivableStore
    const heard: string[] = []
    cloud.subscribe((data) => void heard.push(new TextDecoder().decode(data)))
    await silence()
    const labels = peer.channels.map(({ label, protocol }) => `${label} ${protocol}`).slice(2)
    expect(labels).toEqual(['scan ', 'cloud-0 ', 'cloud-1 '])
    peer.channel('cloud-0').opens()
    peer.channel('cloud-1').opens().says('x')
    await settle()
    expect([cloud.state.get().phase, heard]).toEqual(['open', ['x']])
  })

  test('ask for pictures without saying which: the robot sends what it has, and names it', async () => {
    const { client, platform, peer } = await linked(described())
    const store = client.storeManager.getOrCreateStore(connector('front')) as MediaStreamStore
    expect(platform.socket.sentOf('signaling.send_sdp_offer')).toEqual([{ rtcConnectionId: 'c1', sdpOffer: 'offer-sdp' }])
    expect(peer.transceivers).toHaveLength(2)
    peer.brings('0', 'rear')
    const stream = peer.brings('1', 'front')
    expect(store.mediaStream.get()).toBe(stream)
    expect(client.connection(ROBOT).arrivedPictures.get()).toEqual(['rear', 'front'])
  })

  test('a picture that it does not send is said, with those that it sends', async () => {
    const { client, peer } = await linked(described([{ connectorId: 'frnt', connectorType: 'h1-camera' }]))
    const store = client.storeManager.getOrCreateStore(connector('frnt'))
    peer.brings('0', 'front')
    await silence()
    expect(store.state.get()).toEqual({
      phase: 'closed',
      code: 'channel.unknown_label',
      message: "The robot sends no picture 'frnt' (it sends: front); did you mean 'front'?",
    })
  })

  test('a picture for which no codec is shared says so', async () => {
    const bench = await signedIn(described())
    const store = bench.client.storeManager.getOrCreateStore(connector('front'))
    bench.client.connection(ROBOT).connect()
    const peer = await link(bench.platform, 'v=0\r\nm=video 0 UDP/TLS/RTP/SAVPF 96\r\na=mid:0\r\n')
    expect(peer.transceivers).toHaveLength(2)
    await silence()
    expect(store.state.get()).toEqual({ phase: 'closed', code: 'sdp.no_common_codec' })
  })

  test('count for nothing once the robot turns out to be one of ours', async () => {
    const { client, peer } = await linked(described([{ connectorId: 'battery', connectorType: 'JsonReceivableStore' }]))
    client.storeManager.getOrCreateStore(connector('battery'))
    expect(peer.channel('battery').protocol).toBe('')
    greet(peer)
    await settle()
    expect(peer.channels.filter(({ label }) => label === 'battery').map(({ protocol, readyState }) => [protocol, readyState])).toEqual([
      ['', 'closed'],
      ['mosaic.1', 'connecting'],
    ])
    expect(client.connection(ROBOT).catalogue.get()?.hash).toBe('h1')
  })

  test('described while it is connected appear at once, and are kept on the server', async () => {
    const { client, platform, peer } = await linked({ catalogue: null })
    await silence()
    await client.describeRobot(ROBOT, [{ connectorId: 'odom', connectorType: 'JsonReceivableStore' }])
    expect(client.connection(ROBOT).catalogue.get()?.entries.map(({ label }) => label)).toEqual(['odom'])
    client.storeManager.getOrCreateStore(connector('odom'))
    expect(peer.channel('odom').protocol).toBe('')
    const [put] = platform.requests.filter(({ method }) => method === 'PUT')
    expect(put?.body).toEqual({
      connectorConfig: '{"connectors":[{"connectorId":"odom","connectorType":"JsonReceivableStore","params":{}}]}',
    })
    expect(client.robots.get()[0]?.connectorConfigIsStored).toBe(true)
  })

  test('described anew have the store that they need', async () => {
    const { client } = await linked(described())
    client.storeManager.getOrCreateStore({ ...connector('x'), dataType: 'json-r2u' })
    client.storeManager.releaseStore(connector('x'))
    expect(client.storeManager.getOrCreateStore({ ...connector('x'), dataType: 'media' })).toBeInstanceOf(MediaStreamStore)
  })

  test('tried out as both ways keep the channel that was opened for that', async () => {
    const { client, peer } = await linked(described())
    const tried = client.storeManager.getOrCreateStore({ ...connector('odom'), dataType: 'json-bi' })
    client.storeManager.releaseStore(connector('odom'))
    expect(client.storeManager.getOrCreateStore({ ...connector('odom'), dataType: 'json-r2u' })).toBe(tried)
    await silence()
    expect(peer.channels.filter(({ label }) => label === 'odom')).toHaveLength(1)
  })
})

test('a camera of ours whose line the answer rejects says why it does not come', async () => {
  const bench = await signedIn()
  const [front, rear] = ['front', 'rear'].map((label) => bench.client.storeManager.getOrCreateStore({ ...connector(label), dataType: 'media' }))
  bench.client.connection(ROBOT).connect()
  const peer = await link(bench.platform, 'v=0\r\nm=video 0 X 96\r\na=mid:0\r\nm=video 9 X 96\r\na=mid:1\r\n')
  greet(peer)
  await settle()
  expect(front?.state.get()).toEqual({ phase: 'closed', code: 'sdp.no_common_codec' })
  expect(rear?.state.get().phase).toBe('waiting')
  peer.channel('_mosaic').control('media.unavailable', { label: 'front', code: 'media.no_encoder', message: 'no VP9' })
  expect(front?.state.get()).toEqual({ phase: 'closed', code: 'media.no_encoder', message: 'no VP9' })
})

describe('the check of its connection', () => {
  test.each([
    ['described', described()],
    ['described by nobody', { catalogue: null }],
  ])('has two channels where the connector is %s', async (_what, options) => {
    const { client, peer } = await linked(options)
    const store = new ConnectionCheckingStore(connector('L'))
    client.connection(ROBOT).addStore(store)
    await silence()
    const echo = peer.channel('L-receiver').opens()
    peer.channel('L-sender').opens()
    store.roundTripMs.subscribe(() => {})
    await vi.advanceTimersByTimeAsync(7)
    peer.channel('L-sender').says(echo.texts()[0] ?? '')
    expect(store.roundTripMs.get()).toBeCloseTo(7)
    expect(peer.channels.some(({ label }) => label === 'L')).toBe(false)
  })
})

describe('a stop', () => {
  async function driven(connectors = CONNECTORS) {
    const bench = await linked(described(connectors))
    const store = bench.client.storeManager.getOrCreateStore(connector('teleop')) as SendableStore
    await silence()
    return { ...bench, store, desk: bench.client.connection(ROBOT).control }
  }

  test('sends the zeros of its drive, in the words of its type', async () => {
    const { peer, desk } = await driven()
    peer.channel('teleop').opens()
    expect(desk.restable.get()).toEqual(['teleop'])
    const report = await desk.stop()
    expect(peer.channel('teleop').texts()).toEqual(['{"linear_x":0,"angular_z":0}'])
    expect(report).toMatchObject({ phase: 'unavailable', zeros: { sent: ['teleop'], unsent: [] } })
  })

  test.each([
    ['is not open', () => {}],
    ['takes no more', (channel: FakeDataChannel) => void Object.assign(channel.opens(), { bufferedAmount: 2 ** 21 })],
  ])('is not said to have sent what did not leave: the channel %s', async (_how, prepare) => {
    const { peer, desk } = await driven()
    prepare(peer.channel('teleop'))
    const report = await desk.stop()
    expect(peer.channel('teleop').texts()).toEqual([])
    expect(report.zeros).toEqual({ sent: [], unsent: ['teleop'] })
  })

  test('says that nothing was sent where no drive is known', async () => {
    const { desk } = await driven([{ connectorId: 'scan', connectorType: 'JsonReceivableStore' }])
    expect(desk.restable.get()).toEqual([])
    expect((await desk.stop()).zeros).toEqual({ sent: [], unsent: [] })
  })

  test('before the robot was found to be an original one sends them too, and again when it was', async () => {
    const { client, peer } = await linked(described())
    const desk = client.connection(ROBOT).control
    client.storeManager.getOrCreateStore(connector('teleop'))
    peer.channel('teleop').opens()
    const report = desk.stop()
    expect(peer.channel('teleop').texts()).toHaveLength(1)
    expect(desk.stopState.get().mine?.phase).toBe('sending')
    await silence()
    expect(await report).toMatchObject({ phase: 'unavailable', zeros: { sent: ['teleop'] } })
    expect(peer.channel('teleop').texts()).toHaveLength(2)
  })

  test('of a pad that nobody described sends its zeros as well, while it is there', async () => {
    const { client, peer } = await linked({ catalogue: null })
    await silence()
    const desk = client.connection(ROBOT).control
    const store = client.storeManager.getOrCreateStore({ ...connector('base'), dataType: 'json-u2r' }) as BidirectionalStore
    peer.channel('base').opens()
    const end = desk.addRest('base', { stop: true })
    expect((await desk.stop()).zeros).toEqual({ sent: ['base'], unsent: [] })
    expect(peer.channel('base').texts()).toEqual(['{"stop":true}'])
    expect(store.counters.sent).toBe(1)
    end()
    expect((await desk.stop()).zeros).toEqual({ sent: [], unsent: [] })
  })
})

describe('leaving it', () => {
  const ZERO = '{"linear_x":0,"angular_z":0}'
  const DRIVE = '{"linear_x":1,"angular_z":0}'

  async function driven() {
    const bench = await linked(described())
    const store = bench.client.storeManager.getOrCreateStore(connector('teleop')) as SendableStore
    await silence()
    bench.peer.channel('teleop').opens()
    return { ...bench, store, connection: bench.client.connection(ROBOT), teleop: bench.peer.channel('teleop') }
  }
  type Bench = Awaited<ReturnType<typeof driven>>

  test.each<[string, (bench: Bench) => void]>([
    ['by the way back', ({ connection }) => connection.disconnect()],
    ['with the page', ({ platform }) => platform.happens('hide')],
    ['by signing out', ({ client }) => client.logout()],
  ])('%s sends the zeros of what was driven, before anything is closed', async (_how, leave) => {
    const bench = await driven()
    bench.store.sendData(DRIVE)
    leave(bench)
    expect(bench.teleop.texts()).toEqual([DRIVE, ZERO])
    expect(bench.peer.isClosed).toBe(false)
  })

  test('tells the server only when they have had time to arrive, then closes', async () => {
    const { store, connection, platform, peer } = await driven()
    store.sendData(DRIVE)
    connection.disconnect()
    await vi.advanceTimersByTimeAsync(199)
    expect(platform.socket.sentOf('signaling.close_peer_connection')).toEqual([])
    await vi.advanceTimersByTimeAsync(1)
    expect(platform.socket.sentOf('signaling.close_peer_connection')).toEqual([{ rtcConnectionId: 'c1' }])
    expect(peer.isClosed).toBe(true)
  })

  test('with the page holds the page until they have left, because it gets no later moment', async () => {
    const { store, platform, peer } = await driven()
    store.sendData(DRIVE)
    platform.happens('hide')
    expect(platform.stoodStillMs).toEqual([100])
    expect(platform.socket.sentOf('signaling.close_peer_connection')).toEqual([{ rtcConnectionId: 'c1' }])
    expect(peer.isClosed).toBe(false)
  })

  test('without having driven it sends nothing: who only watched must not stop what others let it do', async () => {
    const { connection, platform, teleop } = await driven()
    connection.disconnect()
    expect(teleop.texts()).toEqual([])
    expect(platform.socket.sentOf('signaling.close_peer_connection')).toHaveLength(1)
  })

  test('before it was found to be an original one sends them too', async () => {
    const { client, peer } = await linked(described())
    const store = client.storeManager.getOrCreateStore(connector('teleop')) as SendableStore
    peer.channel('teleop').opens()
    store.sendData(DRIVE)
    client.connection(ROBOT).disconnect()
    expect(peer.channel('teleop').texts()).toEqual([DRIVE, ZERO])
  })
})
