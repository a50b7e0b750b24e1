import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest'
import {
  BidirectionalStore,
  ConnectionCheckingStore,
  MediaStreamStore,
  ReceivableStore,
  SendableStore,
  type StoreClass,
  type StoreState,
} from '../../src/index'
import { greet, greeted, linked, live, ROBOT, signedIn } from '../bench'

class BatteryStore extends ReceivableStore {
  static readonly dataType = 'json-r2u'
  readonly moments: string[] = []

  protected override beforeConnected(): void {
    this.moments.push('before')
  }
  protected override afterConnected(): void {
    this.moments.push(`connected, ${this.state.get().phase}`)
  }
  protected override afterDisconnected(): void {
    this.moments.push('disconnected')
  }
  protected override afterConnectionFailed(): void {
    this.moments.push('failed')
  }
}

const connector = (connectorId: string) => ({ robotId: ROBOT, connectorId })

beforeEach(() => void vi.useFakeTimers())
afterEach(() => void vi.useRealTimers())

describe('an own store class', () => {
  test.each([
    [{ label: 'battery' }, 'battery'],
    [{ type: 'connection-check' }, 'link'],
    [{ dataType: 'json-r2u' }, 'battery'],
  ] as const)('registered for %o serves %s and nothing else', async (match, label) => {
    const { client } = await greeted()
    client.storeManager.registerMosaicStore(BatteryStore, match)
    expect(client.storeManager.getOrCreateStore(connector(label))).toBeInstanceOf(BatteryStore)
    expect(client.storeManager.getOrCreateStore(connector('cmd_vel'))).not.toBeInstanceOf(BatteryStore)
  })

  test('may say its data type itself; one that says none must be told which connectors are meant', async () => {
    const { client } = await greeted()
    client.storeManager.registerMosaicStore(BatteryStore)
    expect(client.storeManager.getOrCreateStore(connector('battery'))).toBeInstanceOf(BatteryStore)
    const register = client.storeManager.registerMosaicStore.bind(client.storeManager) as (Store: unknown) => void
    expect(() => register(SendableStore)).toThrow("SendableStore has no 'static dataType'")
  })

  test('is found by its label before one by its data type', async () => {
    const { client } = await greeted()
    class Narrow extends ReceivableStore {}
    client.storeManager.registerMosaicStore(Narrow, { label: 'battery' })
    client.storeManager.registerMosaicStore(BatteryStore)
    expect(client.storeManager.getOrCreateStore(connector('battery'))).toBeInstanceOf(Narrow)
  })

  test('hears of its connection by what it overrides', async () => {
    const { client, peer } = await greeted()
    const store = client.storeManager.getOrCreateStore(connector('battery'), BatteryStore)
    peer.channel('battery').opens()
    peer.channel('battery').vanishes()
    expect(store.moments).toEqual(['before', 'connected, open', 'disconnected'])
    store.notifyAfterConnectionFailed({ code: 'ice.failed' })
    expect(store.moments.at(-1)).toBe('failed')
  })

  test('that sends may greet the robot as soon as it can', async () => {
    class GreetingStore extends SendableStore {
      protected override afterConnected(): void {
        this.sendData({ hello: this.robotConnector.connectorId })
      }
    }
    const { client, peer } = await linked({ catalogue: null })
    client.storeManager.getOrCreateStore(connector('lamp'), GreetingStore)
    await vi.advanceTimersByTimeAsync(2000)
    expect(peer.channel('lamp').opens().sent).toEqual(['{"hello":"lamp"}'])
  })

  test('asked for by class comes typed; a plain request and one for its base class share it', async () => {
    const { client } = await greeted()
    const { storeManager } = client
    storeManager.registerMosaicStore(BatteryStore, { label: 'battery' })
    const base = storeManager.getOrCreateStore(connector('battery'), ReceivableStore)
    const own: BatteryStore = storeManager.getOrCreateStore(connector('battery'), BatteryStore)
    expect(own).toBe(base)
    expect(storeManager.getOrCreateStore(connector('battery'))).toBe(own)
  })

  test('does not replace a store that somebody uses, but one that only lingers', async () => {
    const { client, peer } = await greeted()
    const { storeManager } = client
    storeManager.getOrCreateStore(connector('battery'))
    const ask = () => storeManager.getOrCreateStore(connector('battery'), BatteryStore)
    expect(ask).toThrow("'battery' has a ReceivableStore already, and BatteryStore was asked for")
    storeManager.releaseStore(connector('battery'))
    expect(ask()).toBeInstanceOf(BatteryStore)
    expect(peer.channels.filter(({ label }) => label === 'battery')).toHaveLength(2)
    await live(peer, 2000)
    expect(storeManager.getOrCreateStore(connector('battery'))).toBeInstanceOf(BatteryStore)
  })
})

test.each<[string, StoreClass, string]>([
  ['cmd_vel', ReceivableStore, "'cmd_vel' is json-u2r on the robot, json-r2u was asked for"],
  ['battery', MediaStreamStore, "'battery' is json-r2u on the robot, media was asked for"],
  ['battery', ConnectionCheckingStore, "'battery' is a x and has no channel 'battery-receiver'"],
])('a connector of another kind is told: %s as %o', async (label, Store, message) => {
  const { client } = await greeted()
  const store = client.storeManager.getOrCreateStore(connector(label), Store)
  expect(store.state.get()).toMatchObject({ phase: 'mismatch', message })
})

describe('who subscribes to a store', () => {
  test('hears of each moment with its reason, until it has had enough', async () => {
    const { client } = await signedIn()
    const store = client.storeManager.getOrCreateStore(connector('battery'))
    const heard: string[] = []
    const note = (name: string) => (state: StoreState) => void heard.push(`${name} ${state.phase} ${state.code ?? '-'}`)
    const leave = [
      store.onBeforeConnected(note('before')),
      store.onAfterConnected(note('connected')),
      store.onAfterDisconnected(note('disconnected')),
      store.onAfterConnectionFailed(note('failed')),
    ]
    const all = (): void => {
      store.notifyBeforeConnected()
      store.notifyAfterConnected()
      store.notifyInterrupted({ code: 'ice.disconnected' })
      store.notifyAfterDisconnected({ code: 'peer.closed' })
      store.notifyAfterConnectionFailed({ code: 'ice.failed' })
    }
    all()
    leave.forEach((end) => end())
    all()
    expect(heard).toEqual([
      'before waiting -',
      'connected open -',
      'disconnected reconnecting ice.disconnected',
      'disconnected closed peer.closed',
      'failed closed ice.failed',
    ])
  })
})

describe('sendData', () => {
  test('takes an object as JSON, a text and bytes of any kind', async () => {
    const { client, peer } = await linked({ catalogue: null })
    const text = client.storeManager.getOrCreateStore({ ...connector('cmd'), dataType: 'json-bi' }, BidirectionalStore)
    const bytes = client.storeManager.getOrCreateStore({ ...connector('raw'), dataType: 'byte-u2r' }, SendableStore)
    await vi.advanceTimersByTimeAsync(2000)
    const [cmd, raw] = [peer.channel('cmd').opens(), peer.channel('raw').opens()]
    expect([text.sendData({ x: 1, list: [null] }), text.sendData([1, 2]), text.sendData('{"y":2}')]).toEqual([true, true, true])
    expect(cmd.sent).toEqual(['{"x":1,"list":[null]}', '[1,2]', '{"y":2}'])
    expect(text.sendData({ x: Number.NaN })).toBe(false)
    expect(text.counters.refused).toBe(1)
    const view = new DataView(new Uint8Array([9, 1, 2, 9]).buffer, 1, 2)
    for (const data of [new Uint8Array([1]), new Uint16Array([0x0201]), view, new Uint8Array([7]).buffer]) bytes.sendData(data)
    expect(raw.sent.map((sent) => [...(sent as Uint8Array)])).toEqual([[1], [1, 2], [1, 2], [7]])
  })
})

describe('without a catalogue', () => {
  test('the class says which channels an original robot is asked for', async () => {
    const { client, peer } = await linked({ catalogue: null })
    const check = client.storeManager.getOrCreateStore(connector('link'), ConnectionCheckingStore)
    client.storeManager.getOrCreateStore(connector('cam'), MediaStreamStore)
    const sender = client.storeManager.getOrCreateStore(connector('cmd'), SendableStore)
    check.roundTripMs.subscribe(() => {})
    await vi.advanceTimersByTimeAsync(2000)
    const to = peer.channel('link-receiver').opens()
    const back = peer.channel('link-sender').opens()
    peer.channel('cmd').opens()
    expect(peer.channels.map(({ label }) => label)).toEqual(['_mosaic', '_stop', 'link-receiver', 'link-sender', 'cmd'])
    expect(sender.sendData({ x: 1 })).toBe(true)
    expect(peer.channel('cmd').sent).toEqual(['{"x":1}'])
    await vi.advanceTimersByTimeAsync(25)
    back.says(String(to.sent[0]))
    expect(check.roundTripMs.get()).toBeCloseTo(25)
  })

  test('a connection check asked for early, by class or by label, works once the robot has told what it has', async () => {
    const { client, peer } = await linked({ catalogue: null })
    client.storeManager.registerMosaicStore(ConnectionCheckingStore, { label: 'link' })
    const store = client.storeManager.getOrCreateStore(connector('link')) as ConnectionCheckingStore
    expect(store).toBe(client.storeManager.getOrCreateStore(connector('link'), ConnectionCheckingStore))
    expect(store.state.get().phase).toBe('waiting')
    greet(peer)
    store.roundTripMs.subscribe(() => {})
    peer.channel('link-receiver').opens()
    const back = peer.channel('link-sender').opens()
    back.says(peer.channel('link-receiver').texts()[0] ?? '')
    expect(store.roundTripMs.get()).toBe(0)
  })
})
