import { wallClockMs } from '@mosaic/client/parts'
import { afterEach, beforeEach, expect, test, vi } from 'vitest'
import { dataEntry } from '../src/connectors/catalogue'
import type { DataTeller } from '../src/connectors/Connector'
import type { PictureLine, PictureOrigin } from '../src/media/pictureTimes'
import { PageRobot } from '../src/PageRobot'
import { FakeCamera, RobotPlatform, settled } from './fakes'
import type { FakeDataChannel } from '../../client/test/fakes'

const ROBOT = '7d1c2f6e-0b52-4c1e-9a53-2f6f1f0c9b11'
const EXTENSIONS = { catalogue: 1, multiPeer: 1, tickets: 1, iceServers: 1, closeReasons: 1 }
const HELLO = { protocol: 1, extensions: {}, software: 'a page', bootId: 'b', isPerson: true }
const OFFER = { sdpOffer: 'offer-sdp', tracks: { '0': 'camera' } }

let platform: RobotPlatform
let camera: FakeCamera
let teller: DataTeller | null
let robot: PageRobot
const timed = new Map<PictureLine, (origin: PictureOrigin) => void>()

beforeEach(() => {
  vi.useFakeTimers()
  platform = new RobotPlatform()
  camera = new FakeCamera()
  teller = null
  timed.clear()
  const battery = {
    entry: dataEntry('battery', 'BatteryState', 'latest'),
    start: (given: DataTeller) => {
      teller = given
      return () => (teller = null)
    },
  }
  robot = new PageRobot({
    platform,
    baseUrl: 'https://mosaic.example.org',
    credentials: { robotId: ROBOT, token: 'secret' },
    data: [battery],
    tracks: [camera],
    play: null,
    verify: null,
    pictureTimes: (line, told) => {
      timed.set(line, told)
      return () => timed.delete(line)
    },
  })
})

afterEach(() => {
  robot.stop()
  vi.useRealTimers()
})

function signIn(): void {
  robot.start()
  const { socket } = platform
  socket.onopen?.({})
  socket.says('authorize.req', { extensions: EXTENSIONS })
  socket.says('authorize.res', 100)
  socket.says('session.welcome', { server: 's', extensions: EXTENSIONS, iceServers: [], keys: [{ kid: 'k', x: 'AAAA' }] })
}

function ticketFor(peerId: string, name: string, role: string): string {
  const now = wallClockMs() / 1000
  const claims = { robotId: ROBOT, peerId, sub: name, name, role, iat: now, exp: now + 300 }
  return [{ alg: 'EdDSA', kid: 'k' }, claims].map((part) => Buffer.from(JSON.stringify(part)).toString('base64url')).join('.') + '.AA'
}

/** An operator who is connected, and has said hello. */
async function operator(name: string, role = 'operator'): Promise<FakeDataChannel> {
  const rtcConnectionId = `peer-of-${name}`
  platform.socket.says('signaling.prepare_connection', { rtcConnectionId, ticket: ticketFor(rtcConnectionId, name, role) })
  platform.socket.says('signaling.send_sdp_offer', { rtcConnectionId, ...OFFER })
  await settled()
  const control = platform.answering.connects()
  control.control('hello', HELLO)
  return control
}

function heard(control: FakeDataChannel, type: string): Record<string, unknown>[] {
  return control.controlSent().flatMap((message) => (message.type === type ? [message.data] : []))
}

test('it signs in as a robot, and says what it has before that it is ready', () => {
  signIn()
  const [authorize, announce, status] = platform.socket.sent
  expect(platform.socket.url).toBe('wss://mosaic.example.org/ws/robot')
  expect(authorize).toEqual({ type: 'authorize', data: { robotId: ROBOT, data: 'secret', extensions: EXTENSIONS } })
  expect(announce).toMatchObject({ type: 'catalogue.announce', data: { catalogue: { entries: [{ label: 'camera' }, { label: 'battery' }, { label: 'log' }] } } })
  expect(status).toEqual({ type: 'status.update', data: { status: 0 } })
  expect(robot.state.get().server).toBe('online')
})

test('before the welcome nobody is told anything', () => {
  robot.start()
  platform.socket.onopen?.({})
  platform.socket.says('authorize.req', { extensions: EXTENSIONS })
  platform.socket.says('authorize.res', 100)
  expect(robot.state.get().server).toBe('connecting')
  expect(platform.socket.sentOf('status.update')).toEqual([])
})

test('a token that counts no more ends it, with the reason', () => {
  robot.start()
  platform.socket.onopen?.({})
  platform.socket.says('authorize.req', { extensions: EXTENSIONS })
  platform.socket.onclose?.({ code: 4409 })
  expect(robot.state.get()).toMatchObject({ refusal: 'signal.replaced', server: 'offline' })
})

test('another network means another socket', () => {
  signIn()
  platform.happens('network')
  expect(platform.sockets.length).toBe(2)
  expect(platform.sockets[0]?.isClosed).toBe(true)
})

test('an operator hears hello, the catalogue, who is here and that nothing is stopped', async () => {
  signIn()
  const control = await operator('Ada')
  expect(platform.socket.sentOf('signaling.send_sdp_answer')).toEqual([{ rtcConnectionId: 'peer-of-Ada', sdpAnswer: 'answer-sdp' }])
  expect(platform.answering.lines.map(({ direction }) => direction)).toEqual(['sendonly'])
  expect(control.controlSent().map(({ type }) => type)).toEqual(['hello', 'catalogue', 'peers', 'stop.state'])
  expect(heard(control, 'hello')[0]).toMatchObject({ isPerson: false })
  expect(heard(control, 'peers')[0]).toMatchObject({ you: 'peer-of-Ada', peers: [{ name: 'Ada', role: 'operator', isPerson: true }] })
  expect(robot.state.get().viewers).toMatchObject([{ name: 'Ada', labels: [], isVerified: false }])
})

test('the camera is on while somebody watches, and the page says who', async () => {
  signIn()
  const control = await operator('Ada')
  expect(camera.isAsked).toBe(false)
  control.control('media.watch', { label: 'camera', on: true })
  const track = await camera.opens()
  expect(platform.answering.lines[0]?.sender.track).toBe(track)
  expect(robot.state.get()).toMatchObject({ captured: { camera: track }, viewers: [{ labels: ['camera'] }] })
  control.control('media.watch', { label: 'camera', on: false })
  expect(track.isStopped).toBe(true)
  expect(robot.state.get().captured).toEqual({})
})

test('how the timestamps of its pictures are read is told to whom they go, until they leave', async () => {
  signIn()
  platform.offered = ['video', 'audio']
  const control = await operator('Ada')
  const [line] = platform.answering.lines
  expect([...timed.keys()]).toEqual([line?.sender])
  timed.get(line?.sender as unknown as PictureLine)?.({ ssrc: 7, rtpOrigin: 9 })
  expect(heard(control, 'media.origin')).toEqual([{ label: 'camera', ssrc: 7, rtpOrigin: 9, bootId: robot.bootId }])
  expect(heard(control, 'hello')[0]).toMatchObject({ extensions: { mediaOrigin: 1 } })
  control.control('renegotiate.offer', { attempt: 1, sdp: 'again', tracks: { '0': 'camera' } })
  await settled()
  expect(timed.size).toBe(1)
  control.control('bye', { code: 'peer.closed' })
  expect(timed.size).toBe(0)
})

test('what it does not have, and what it may not film, is said', async () => {
  signIn()
  const control = await operator('Ada')
  control.control('media.watch', { label: 'cemara', on: true })
  expect(heard(control, 'media.unavailable')).toEqual([{ label: 'cemara', code: 'channel.unknown_label' }])
  control.control('media.watch', { label: 'camera', on: true })
  await camera.fails('Allow it.')
  expect(heard(control, 'media.unavailable')[1]).toEqual({ label: 'camera', code: 'media.not_sent', message: 'Allow it.' })
  expect(robot.state.get().problems).toEqual({ camera: 'Allow it.' })
})

test('values travel while somebody listens; nobody may send any', async () => {
  signIn()
  const control = await operator('Ada')
  const channel = platform.answering.opensChannel('battery')
  await settled()
  teller?.tell({ percent: 80 })
  expect(channel.texts()).toEqual(['{"percent":80}'])
  channel.says('{"percent":0}')
  expect(heard(control, 'refusal')).toEqual([{ label: 'battery', seq: 1, code: 'channel.wrong_direction' }])
  channel.vanishes()
  expect(teller).toBeNull()
})

test('a channel of another name, or of an original, is closed', async () => {
  signIn()
  const control = await operator('Ada')
  platform.answering.opensChannel('motor')
  platform.answering.opensChannel('battery', '')
  expect(heard(control, 'refusal').map(({ label, code }) => [label, code])).toEqual([
    ['motor', 'channel.unknown_label'],
    ['battery', 'channel.unknown_label'],
  ])
  expect(teller).toBeNull()
})

test('a ticket for somebody else is refused, and named in the log', async () => {
  signIn()
  platform.socket.says('signaling.prepare_connection', { rtcConnectionId: 'a', ticket: ticketFor('b', 'Eve', 'operator') })
  platform.socket.says('signaling.send_sdp_offer', { rtcConnectionId: 'a', ...OFFER })
  await settled()
  platform.socket.says('signaling.send_sdp_offer', { rtcConnectionId: 'unprepared', ...OFFER })
  await settled()
  expect(platform.peers).toEqual([])
  expect(platform.socket.sentOf('signaling.close_peer_connection')).toMatchObject([
    { rtcConnectionId: 'a', code: 'auth.bad_ticket' },
    { rtcConnectionId: 'unprepared', code: 'auth.bad_ticket' },
  ])
})

test('the seventh operator is refused, and comes in when somebody has left', async () => {
  signIn()
  const controls: FakeDataChannel[] = []
  for (let count = 0; count < 6; count += 1) controls.push(await operator(`A${count}`))
  expect(platform.socket.sentOf('status.update').at(-1)).toEqual({ status: 2 })
  platform.socket.says('signaling.send_sdp_offer', { rtcConnectionId: 'seventh', ...OFFER })
  expect(platform.socket.sentOf('signaling.close_peer_connection')).toMatchObject([{ rtcConnectionId: 'seventh', code: 'signal.robot_busy' }])
  const [first, second] = controls
  first?.control('bye', { code: 'peer.closed' })
  expect(platform.socket.sentOf('status.update').at(-1)).toEqual({ status: 0 })
  expect(second && heard(second, 'peers').at(-1)?.['peers']).toHaveLength(5)
})

test('a stop is acknowledged where it was said, everybody hears of it, and a supervisor clears it', async () => {
  signIn()
  const ada = await operator('Ada')
  const stop = platform.answering.opensChannel('_stop')
  const sue = await operator('Sue', 'supervisor')
  stop.control('stop', { id: 's1', reason: 'cat' })
  expect(stop.controlSent()).toMatchObject([{ type: 'stop.ack', data: { id: 's1' } }])
  expect(heard(sue, 'stop.state').at(-1)).toMatchObject({ isStopped: true, by: 'Ada', reason: 'cat' })
  ada.control('stop.clear', {})
  expect(heard(ada, 'refusal')).toMatchObject([{ code: 'lease.required' }])
  sue.control('stop.clear', {})
  expect(heard(ada, 'stop.state').at(-1)).toMatchObject({ isStopped: false })
  expect(robot.state.get().isStopped).toBe(false)
})

test('nothing can be commanded, and that is said', async () => {
  signIn()
  const control = await operator('Ada')
  control.control('lease.request', { resource: 'motion', reason: '', force: false })
  expect(heard(control, 'lease.reply')).toMatchObject([{ resource: 'motion', outcome: 'denied', code: 'lease.unknown_resource' }])
})

test('a ping is answered with the times of this page', async () => {
  signIn()
  const control = await operator('Ada')
  control.control('ping', { t0: 5 })
  expect(heard(control, 'pong')).toMatchObject([{ t0: 5, t1: expect.any(Number) as number, t2: expect.any(Number) as number }])
})

test('a further offer is answered on the control channel', async () => {
  signIn()
  const control = await operator('Ada')
  platform.answering.offers('video')
  control.control('renegotiate.offer', { attempt: 1, sdp: 'more', tracks: { '1': 'camera' } })
  await settled()
  expect(heard(control, 'renegotiate.answer')).toEqual([{ attempt: 1, sdp: 'answer-sdp', code: '' }])
})

test('who says nothing for two seconds is lost, and films no more', async () => {
  signIn()
  const control = await operator('Ada')
  control.control('media.watch', { label: 'camera', on: true })
  const track = await camera.opens()
  vi.advanceTimersByTime(2000)
  expect(track.isStopped).toBe(true)
  expect(platform.answering.isClosed).toBe(true)
  expect(robot.state.get().viewers).toEqual([])
  expect(platform.socket.sentOf('signaling.close_peer_connection')).toMatchObject([{ rtcConnectionId: 'peer-of-Ada', code: 'peer.lost' }])
})

test('stop ends everything at once: goodbye is said, the camera and the socket are closed', async () => {
  signIn()
  const control = await operator('Ada')
  control.control('media.watch', { label: 'camera', on: true })
  const track = await camera.opens()
  robot.stop()
  expect(heard(control, 'bye')).toEqual([{ code: 'peer.shutdown' }])
  expect(track.isStopped).toBe(true)
  expect(platform.answering.isClosed).toBe(true)
  expect(platform.socket.sentOf('status.update').at(-1)).toEqual({ status: 5 })
  expect(platform.socket.isClosed).toBe(true)
  expect(robot.state.get()).toMatchObject({ viewers: [], captured: {}, server: 'offline' })
})

test('an operator who is being checked when it stops is not taken', async () => {
  signIn()
  platform.socket.says('signaling.prepare_connection', { rtcConnectionId: 'a', ticket: ticketFor('a', 'Ada', 'operator') })
  platform.socket.says('signaling.send_sdp_offer', { rtcConnectionId: 'a', ...OFFER })
  robot.stop()
  await settled()
  expect(platform.peers).toEqual([])
})

test('candidates that come while the ticket is checked are not lost', async () => {
  signIn()
  const iceCandidate = { candidate: 'one', sdpMid: '0', sdpMLineIndex: 0 }
  platform.socket.says('signaling.prepare_connection', { rtcConnectionId: 'a', ticket: ticketFor('a', 'Ada', 'operator') })
  platform.socket.says('signaling.send_sdp_offer', { rtcConnectionId: 'a', ...OFFER })
  platform.socket.says('signaling.exchange_ice_candidate', { rtcConnectionId: 'a', iceCandidate })
  await settled()
  platform.socket.says('signaling.exchange_ice_candidate', { rtcConnectionId: 'a', iceCandidate: { ...iceCandidate, candidate: 'two' } })
  await settled()
  expect(platform.answering.candidates).toMatchObject([{ candidate: 'one' }, { candidate: 'two' }])
})

test('a page that is looked at again looks for the server at once', () => {
  signIn()
  platform.socket.onclose?.({ code: 1006 })
  robot.wake()
  expect(platform.sockets.length).toBe(2)
})
