/** A signed-in client with one robot, ready to be moved. */
import type { Catalogue, CatalogueEntry } from '@mosaic/protocol'
import { vi } from 'vitest'
import { MosaicClient } from '../src/index'
import { FakePlatform, ok, type FakePeerConnection } from './fakes'

export const ROBOT = 'robot-1'
const USER = { id: 'u', email: 'a@b.c', isActive: true, isOrganizationAdmin: true, fullName: 'Ada' }
const INFO = { id: ROBOT, name: 'Robbie', description: '', status: 0, authType: 1, organizationId: 'o', isOnline: true }

export function entry(label: string, more: Partial<CatalogueEntry> = {}): CatalogueEntry {
  const dataType = more.dataType ?? 'json-r2u'
  return { label, type: 'x', kind: 'data', dataType, direction: 'both', channels: [], delivery: 'reliable', ...more }
}

export const CATALOGUE: Catalogue = {
  hash: 'h1',
  entries: [
    entry('front', { dataType: 'media', kind: 'video' }),
    entry('battery'),
    entry('cmd_vel', { dataType: 'json-u2r', delivery: 'latest' }),
    entry('rear', { dataType: 'media', kind: 'video' }),
    entry('link', {
      type: 'connection-check',
      dataType: 'string-u2r',
      channels: [
        { label: 'link-receiver', dataType: 'string-u2r' },
        { label: 'link-sender', dataType: 'string-r2u' },
      ],
    }),
  ],
}

export interface BenchOptions {
  catalogue?: Catalogue | null
  /** What people wrote down of a robot that announces nothing. */
  connectorConfig?: string | null
}

export async function signedIn({ catalogue = CATALOGUE, connectorConfig = null }: BenchOptions = {}): Promise<{
  platform: FakePlatform
  client: MosaicClient
}> {
  const platform = new FakePlatform()
  const info = { ...INFO, connectorConfig, connectorConfigIsStored: connectorConfig !== null }
  let connections = 0
  Object.assign(platform.routes, {
    'POST /api/v1/account/login/access-token': () => ok({ accessToken: 'jwt', existingConnection: false }),
    'GET /api/v1/users/me': () => ok(USER),
    'GET /api/v1/robots': () => ok({ data: [info], count: 1 }),
    [`GET /api/v1/robots/${ROBOT}`]: () => ok(info),
    [`PUT /api/v1/robots/${ROBOT}/connector-config`]: (body: unknown) => ok(Object.assign(info, body)),
    [`GET /api/v1/robots/${ROBOT}/catalogue`]: () => ok(catalogue),
    'GET /api/v1/webrtc/ice-servers': () => [{ urls: 'turn.example.org:3478', username: 'u', credential: 'c' }],
    'POST /api/v1/webrtc/connection': () =>
      ok({ sessions: [{ robotId: ROBOT, rtcSessionId: `c${++connections}`, sessionId: 's1' }] }),
  })
  const client = new MosaicClient({ baseUrl: 'https://mosaic.example.org', platform })
  await client.login('a@b.c', 'secret')
  platform.socket.online()
  await settle()
  return { platform, client }
}

/** Let promises run, without time passing. */
export async function settle(): Promise<void> {
  await vi.advanceTimersByTimeAsync(0)
}

/** Connect as far as the link; the robot has not spoken. */
export async function linked(options: BenchOptions = {}): Promise<{
  platform: FakePlatform
  client: MosaicClient
  peer: FakePeerConnection
}> {
  const bench = await signedIn(options)
  bench.client.connection(ROBOT).connect()
  const peer = await link(bench.platform)
  return { ...bench, peer }
}

/** Answer the newest offer and link. */
export async function link(platform: FakePlatform, sdpAnswer = 'answer-sdp'): Promise<FakePeerConnection> {
  await settle()
  const { peer, socket } = platform
  const offer = socket.sentOf('signaling.send_sdp_offer').at(-1) as { rtcConnectionId: string }
  socket.says('signaling.send_sdp_answer', { rtcConnectionId: offer.rtcConnectionId, sdpAnswer })
  await settle()
  peer.links()
  return peer
}

/** Connected to a robot of ours. */
export async function greeted(options: BenchOptions = {}): ReturnType<typeof linked> {
  const bench = await linked(options)
  greet(bench.peer, options.catalogue === undefined ? CATALOGUE : options.catalogue)
  return bench
}

export function greet(peer: FakePeerConnection, catalogue: Catalogue | null = CATALOGUE): void {
  const control = peer.channel('_mosaic')
  control.control('hello', { protocol: 1, extensions: {}, software: 'mosaic-core/0.1.0', bootId: 'b1', isPerson: false })
  if (catalogue) control.control('catalogue', { catalogue })
}

/** Pings are answered for `ms`, as a living robot does. */
export async function live(peer: FakePeerConnection, ms: number): Promise<void> {
  for (let passedMs = 0; passedMs < ms; passedMs += 250) {
    await vi.advanceTimersByTimeAsync(250)
    peer.channel('_mosaic').control('pong', { t0: 0, t1: 0, t2: 0 })
  }
}
