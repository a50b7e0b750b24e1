import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest'
import type { Catalogue } from '@mosaic/protocol'
import type { MosaicClient, ReceivableStore } from '../../src/index'
import { entry, link, linked, live, ROBOT, settle } from '../bench'
import type { FakePeerConnection, FakePlatform } from '../fakes'

beforeEach(() => {
  vi.useFakeTimers({ toFake: ['setTimeout', 'clearTimeout', 'setInterval', 'clearInterval', 'performance', 'Date'] })
})

afterEach(() => {
  vi.useRealTimers()
})

const WITH_MAP: Catalogue = { hash: 'h2', entries: [entry('battery'), entry('map', { delivery: 'bulk' })] }

interface Bench {
  platform: FakePlatform
  client: MosaicClient
  main: FakePeerConnection
}

function greetedWithBulk(peer: FakePeerConnection, extensions: Record<string, number> = { bulkLane: 1 }): void {
  const hello = { protocol: 1, extensions, software: 'mosaic-core', bootId: 'b1', isPerson: false }
  peer.channel('_mosaic').control('hello', hello)
  peer.channel('_mosaic').control('catalogue', { catalogue: WITH_MAP })
}

async function connected(extensions?: Record<string, number>): Promise<Bench> {
  const { platform, client, peer } = await linked({ catalogue: WITH_MAP })
  greetedWithBulk(peer, extensions)
  return { platform, client, main: peer }
}

const store = ({ client }: Bench, connectorId: string): ReceivableStore =>
  client.storeManager.getOrCreateStore({ robotId: ROBOT, connectorId }) as ReceivableStore

const stateOf = ({ client }: Bench) => client.connection(ROBOT).bulkLane.get()

const said = ({ main }: Bench, type: string) =>
  main.channel('_mosaic').controlSent().filter((one) => one.type === type).map(({ data }) => data)

const labelsOf = (peer: FakePeerConnection): string[] => peer.channels.map(({ label }) => label)

/** Answer the newest offer and open its own channel. */
async function bulkUp(bench: Bench): Promise<FakePeerConnection> {
  await settle()
  const { attempt } = said(bench, 'lane.offer').at(-1) as { attempt: number }
  bench.main.channel('_mosaic').control('lane.answer', { lane: 'bulk', attempt, sdp: 'lane-answer' })
  await settle()
  const bulk = bench.platform.peer
  bulk.channel('_lane').opens()
  return bulk
}

describe('the bulk connection', () => {
  test('is made for the first bulk store, and only bulk goes there', async () => {
    const bench = await connected()
    store(bench, 'battery')
    await settle()
    expect(bench.platform.peers).toHaveLength(1)
    expect(stateOf(bench)).toEqual({ phase: 'none' })
    const map = store(bench, 'map')
    expect(stateOf(bench)).toEqual({ phase: 'connecting' })
    expect(map.state.get().phase).toBe('waiting')
    const bulk = await bulkUp(bench)
    expect(stateOf(bench)).toEqual({ phase: 'up' })
    expect(labelsOf(bulk)).toEqual(['_lane', 'map'])
    expect(labelsOf(bench.main)).toEqual(['_mosaic', '_stop', 'battery'])
    bulk.channel('map').opens()
    expect(map.state.get().phase).toBe('open')
    const heard: unknown[] = []
    map.subscribe((buffer) => void heard.push(new TextDecoder().decode(buffer)))
    bulk.channel('map').says('{"cells":1}')
    expect(heard).toEqual(['{"cells":1}'])
  })

  test('is offered with its number, over the control channel alone', async () => {
    const bench = await connected()
    store(bench, 'map')
    await settle()
    expect(said(bench, 'lane.offer')).toEqual([{ lane: 'bulk', attempt: 1, sdp: 'offer-sdp' }])
    bench.platform.peer.finds('candidate:7')
    expect(said(bench, 'lane.candidate')).toEqual([
      { lane: 'bulk', attempt: 1, candidate: 'candidate:7', sdpMid: '0', sdpMLineIndex: 0 },
    ])
    expect(bench.platform.socket.sentOf('signaling.send_sdp_offer')).toHaveLength(1)
    const theirs = { lane: 'bulk', attempt: 1, candidate: 'candidate:9', sdpMid: '0', sdpMLineIndex: 0 } as const
    bench.main.channel('_mosaic').control('lane.candidate', theirs)
    bench.main.channel('_mosaic').control('lane.candidate', { ...theirs, attempt: 2 })
    await bulkUp(bench)
    expect(bench.platform.peer.candidates).toEqual([{ candidate: 'candidate:9', sdpMid: '0', sdpMLineIndex: 0 }])
  })

  test('is not asked of a robot that knows none', async () => {
    const bench = await connected({})
    store(bench, 'map')
    await settle()
    expect(bench.platform.peers).toHaveLength(1)
    expect(labelsOf(bench.main)).toContain('map')
    expect(stateOf(bench)).toEqual({ phase: 'none' })
  })

  test('that the robot refuses leaves bulk on the main connection, and is tried again', async () => {
    const bench = await connected()
    const map = store(bench, 'map')
    await settle()
    bench.main.channel('_mosaic').control('lane.close', { lane: 'bulk', attempt: 1, code: 'lane.refused' })
    expect(stateOf(bench)).toEqual({ phase: 'failed', code: 'lane.refused' })
    expect(said(bench, 'lane.close')).toEqual([])
    bench.main.channel('map').opens()
    expect(map.state.get().phase).toBe('open')
    await live(bench.main, 3500)
    expect(said(bench, 'lane.offer')).toHaveLength(2)
  })

  test('that finds no path in five seconds is given up', async () => {
    const bench = await connected()
    store(bench, 'map')
    await live(bench.main, 5250)
    expect(stateOf(bench)).toEqual({ phase: 'failed', code: 'ice.timeout' })
    expect(said(bench, 'lane.close')).toEqual([{ lane: 'bulk', attempt: 1, code: 'ice.timeout' }])
    expect(bench.platform.peer.isClosed).toBe(true)
    expect(labelsOf(bench.main)).toContain('map')
  })

  test('that falls silent is given up, one that answers lives', async () => {
    const bench = await connected()
    const map = store(bench, 'map')
    const bulk = await bulkUp(bench)
    bulk.channel('map').opens()
    for (let second = 0; second < 12; second += 1) {
      await live(bench.main, 1000)
      bulk.channel('_lane').control('pong', { t0: 0, t1: 0, t2: 0 })
    }
    expect(stateOf(bench)).toEqual({ phase: 'up' })
    await live(bench.main, 10_500)
    expect(stateOf(bench)).toEqual({ phase: 'failed', code: 'peer.lost' })
    expect(bulk.isClosed).toBe(true)
    expect(map.state.get().phase).not.toBe('open')
    bench.main.channel('map').opens()
    expect(map.state.get().phase).toBe('open')
  })

  test('is not given up for what the one before it still learns', async () => {
    const bench = await connected()
    store(bench, 'map')
    await settle()
    let refuse = (): void => {}
    bench.platform.peer.setRemoteDescription = () => new Promise((_resolve, reject) => (refuse = () => reject(new Error('closed'))))
    bench.main.channel('_mosaic').control('lane.answer', { lane: 'bulk', attempt: 1, sdp: 'lane-answer' })
    bench.main.channel('_mosaic').control('bye', { code: 'peer.shutdown' })
    await vi.advanceTimersByTimeAsync(500)
    greetedWithBulk(await link(bench.platform))
    await settle()
    expect(stateOf(bench)).toEqual({ phase: 'connecting' })
    refuse()
    await settle()
    expect(stateOf(bench)).toEqual({ phase: 'connecting' })
  })

  test('ends with its main connection', async () => {
    const bench = await connected()
    store(bench, 'map')
    const bulk = await bulkUp(bench)
    bench.client.connection(ROBOT).disconnect()
    expect(bulk.isClosed).toBe(true)
    expect(stateOf(bench)).toEqual({ phase: 'none' })
  })
})
