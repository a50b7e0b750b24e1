import type { Catalogue } from '@mosaic/protocol'
import { afterEach, beforeEach, expect, test, vi } from 'vitest'
import type { MediaStreamStore} from '../../src/index';
import { TalkStore } from '../../src/index'
import { mediaLines } from '../../src/bindings/mediaLines'
import { CATALOGUE, entry, greet, greeted, link, ROBOT, settle } from '../bench'
import type { FakePeerConnection } from '../fakes'

const SOUND: Catalogue = {
  hash: 's1',
  entries: [
    entry('cabin', { dataType: 'media', kind: 'audio', direction: 'to-operator' }),
    ...CATALOGUE.entries,
    entry('horn', { dataType: 'media', kind: 'audio', direction: 'to-robot' }),
  ],
}
const TRACK = {} as MediaStreamTrack

beforeEach(() => {
  vi.useFakeTimers()
})

afterEach(() => {
  vi.useRealTimers()
})

const hornOf = ({ transceivers }: FakePeerConnection) => transceivers.find(({ init }) => init.direction === 'sendonly')
const watches = (peer: FakePeerConnection) =>
  peer
    .channel('_mosaic')
    .controlSent()
    .filter(({ type }) => type === 'media.watch')
    .map(({ data }) => data)

async function talking() {
  const bench = await greeted({ catalogue: SOUND })
  const store = bench.client.storeManager.getOrCreateStore({ robotId: ROBOT, connectorId: 'horn', dataType: 'media' })
  if (!(store instanceof TalkStore)) throw new Error('no talk store')
  return { ...bench, store }
}

test('sound never takes a line from a picture: it comes after all of them, in the catalogue’s order', () => {
  expect(mediaLines(SOUND, 0)).toEqual([
    { label: 'front', kind: 'video' },
    { label: 'rear', kind: 'video' },
    { label: 'cabin', kind: 'audio' },
    { label: 'horn', kind: 'audio', isTalk: true },
  ])
})

test('a robot whose catalogue nobody knows is offered no sound', () => {
  expect(new Set(mediaLines(null, 3).map(({ kind }) => kind))).toEqual(new Set(['video']))
})

test('the offer has a line to hear on and one to talk on, each with its label', async () => {
  const { platform, peer } = await greeted({ catalogue: SOUND })
  expect(peer.transceivers.map(({ kind, init }) => [kind, init.direction])).toEqual([
    ['video', 'recvonly'],
    ['video', 'recvonly'],
    ['audio', 'recvonly'],
    ['audio', 'sendonly'],
  ])
  expect(platform.socket.sentOf('signaling.send_sdp_offer')).toMatchObject([
    { tracks: { '0': 'front', '1': 'rear', '2': 'cabin', '3': 'horn' } },
  ])
})

test('nothing is sent before somebody talks, and nothing after', async () => {
  const { peer, store } = await talking()
  expect(store.state.get().phase).toBe('open')
  expect(hornOf(peer)?.sentTracks).toEqual([])
  expect(await store.setTrack(TRACK)).toBe(true)
  await store.setTrack(null)
  expect(hornOf(peer)?.sentTracks).toEqual([TRACK, null])
})

test('who talks is told to the store, also to one that is made later', async () => {
  const bench = await greeted({ catalogue: SOUND })
  const control = bench.peer.channel('_mosaic')
  control.control('media.talking', { label: 'horn', peerId: 'p2', name: 'Bob' })
  const store = bench.client.storeManager.getOrCreateStore({ robotId: ROBOT, connectorId: 'horn', dataType: 'media' }) as TalkStore
  expect(store.talker.get()).toEqual({ peerId: 'p2', name: 'Bob' })
  control.control('media.talking', { label: 'horn', name: '' })
  expect(store.talker.get()).toBeNull()
})

test('a refusal is told until the next attempt', async () => {
  const { peer, store } = await talking()
  peer.channel('_mosaic').control('refusal', { label: 'horn', code: 'media.talk_busy', message: 'Bob is talking.' })
  expect(store.lastRefusal.get()?.code).toBe('media.talk_busy')
  await store.setTrack(TRACK)
  expect(store.lastRefusal.get()).toBeNull()
})

test('a robot without a line for it says why', async () => {
  const { peer, store } = await talking()
  peer.channel('_mosaic').control('media.unavailable', { label: 'horn', code: 'media.no_line' })
  expect(store.state.get()).toMatchObject({ phase: 'closed', code: 'media.no_line' })
})

test('a connection that is lost takes the voice with it; the next one begins in silence', async () => {
  const { platform, peer, store } = await talking()
  await store.setTrack(TRACK)
  peer.connectionState = 'failed'
  peer.onconnectionstatechange?.()
  await settle()
  expect(await store.setTrack(TRACK)).toBe(false)
  expect(store.state.get().phase).toBe('reconnecting')
  await vi.advanceTimersByTimeAsync(2000)
  const next = await link(platform)
  greet(next, SOUND)
  expect(next).not.toBe(peer)
  expect(store.state.get().phase).toBe('open')
  expect(hornOf(next)?.sentTracks).toEqual([])
})

test('sound goes on in a hidden tab, and its age is never reported as a picture’s', async () => {
  const { platform, client, peer } = await greeted({ catalogue: SOUND })
  const store = client.storeManager.getOrCreateStore({ robotId: ROBOT, connectorId: 'cabin', dataType: 'media' }) as MediaStreamStore
  store.mediaStream.subscribe(() => {})
  expect(watches(peer)).toEqual([{ label: 'cabin', on: true }])
  platform.visible = false
  platform.happens('visibility')
  expect(watches(peer)).toEqual([{ label: 'cabin', on: true }])
  await vi.advanceTimersByTimeAsync(300)
  expect(peer.channel('_mosaic').controlSent().map(({ type }) => type)).not.toContain('media.seen')
})
