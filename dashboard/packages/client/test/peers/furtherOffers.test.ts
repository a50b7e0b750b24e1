import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest'
import type { Catalogue } from '@mosaic/protocol'
import type { MediaStreamStore, MosaicClient } from '../../src/index'
import { CATALOGUE, entry, linked, live, ROBOT, settle } from '../bench'
import type { FakePeerConnection } from '../fakes'

beforeEach(() => {
  vi.useFakeTimers({ toFake: ['setTimeout', 'clearTimeout', 'setInterval', 'clearInterval', 'performance', 'Date'] })
})

afterEach(() => {
  vi.useRealTimers()
  vi.restoreAllMocks()
})

const CAMERA = { dataType: 'media', kind: 'video' } as const
/** What the robot itself says: the server knew two cameras, one was added since. */
const GROWN: Catalogue = { hash: 'h9', entries: [...CATALOGUE.entries, entry('gripper', CAMERA)] }

interface Bench {
  client: MosaicClient
  peer: FakePeerConnection
}

async function connected(extensions: Record<string, number> = { renegotiate: 1 }): Promise<Bench> {
  const { client, peer } = await linked()
  peer.channel('_mosaic').control('hello', { protocol: 1, extensions, software: 'x', bootId: 'b1', isPerson: false })
  peer.channel('_mosaic').control('catalogue', { catalogue: GROWN })
  await settle()
  return { client, peer }
}

const watched = ({ client }: Bench, connectorId: string): MediaStreamStore => {
  const store = client.storeManager.getOrCreateStore({ robotId: ROBOT, connectorId }) as MediaStreamStore
  store.mediaStream.subscribe(() => undefined)
  return store
}

const said = ({ peer }: Bench, type: string) =>
  peer.channel('_mosaic').controlSent().filter((one) => one.type === type).map(({ data }) => data)

describe('a camera that was not in the first offer', () => {
  test('is offered on the live connection as soon as somebody wants it', async () => {
    const bench = await connected()
    expect(said(bench, 'renegotiate.offer')).toEqual([])
    const store = watched(bench, 'gripper')
    await settle()
    const tracks = { 0: 'front', 1: 'rear', 2: 'gripper' }
    expect(said(bench, 'renegotiate.offer')).toEqual([{ attempt: 1, sdp: 'offer-sdp', tracks }])
    bench.peer.channel('_mosaic').control('renegotiate.answer', { attempt: 1, sdp: 'more', code: '' })
    await settle()
    expect(bench.peer.remoteDescription?.sdp).toBe('more')
    const stream = bench.peer.brings('2', 'gripper')
    expect(store.mediaStream.get()).toBe(stream)
    expect(store.state.get().phase).toBe('open')
    expect(said(bench, 'renegotiate.offer')).toHaveLength(1)
  })

  test('is asked for again when it has its line: the first wish was refused', async () => {
    const bench = await connected()
    watched(bench, 'gripper')
    await settle()
    bench.peer.channel('_mosaic').control('media.unavailable', { label: 'gripper', code: 'media.no_line' })
    bench.peer.channel('_mosaic').control('renegotiate.answer', { attempt: 1, sdp: 'more', code: '' })
    await settle()
    const before = said(bench, 'media.watch').length
    bench.peer.brings('2', 'gripper')
    expect(said(bench, 'media.watch').slice(before)).toEqual([{ label: 'gripper', on: true }])
  })

  test('is not offered to a robot that knows no further offers', async () => {
    const bench = await connected({})
    watched(bench, 'gripper')
    await settle()
    expect(said(bench, 'renegotiate.offer')).toEqual([])
    expect(bench.peer.transceivers).toHaveLength(2)
  })

  test('that the robot refuses leaves the connection as it is, and is not offered again', async () => {
    const warn = vi.spyOn(console, 'warn').mockReturnValue()
    const bench = await connected()
    watched(bench, 'gripper')
    await settle()
    bench.peer.channel('_mosaic').control('renegotiate.answer', { attempt: 1, code: 'sdp.no_common_codec' })
    await settle()
    expect(bench.client.connection(ROBOT).state.get().phase).toBe('connected')
    expect(warn).toHaveBeenCalledOnce()
    bench.peer.channel('_mosaic').control('catalogue', { catalogue: { ...GROWN, hash: 'h10' } })
    await settle()
    expect(said(bench, 'renegotiate.offer')).toHaveLength(1)
  })

  test('that nobody answers for is given up, and a late answer changes nothing', async () => {
    const warn = vi.spyOn(console, 'warn').mockReturnValue()
    const bench = await connected()
    watched(bench, 'gripper')
    await live(bench.peer, 10_500)
    expect(warn).toHaveBeenCalledOnce()
    bench.peer.channel('_mosaic').control('renegotiate.answer', { attempt: 1, sdp: 'late', code: '' })
    await settle()
    expect(bench.peer.remoteDescription?.sdp).toBe('answer-sdp')
  })
})
