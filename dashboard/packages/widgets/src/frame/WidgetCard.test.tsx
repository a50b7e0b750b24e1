import { MantineProvider } from '@mantine/core'
import {
  DeliveryWatch,
  StoreCounters,
  Value,
  type CatalogueEntry,
  type ConnectionState,
  type DeliveryRow,
  type Gap,
  type MessageInfo,
  type MosaicClient,
  type ServerState,
  type StoreState,
} from '@mosaic/client'
import { MosaicProvider } from '@mosaic/react'
import { act, cleanup, render, screen } from '@testing-library/react'
import { afterEach, beforeEach, expect, test, vi } from 'vitest'
import { chooseWidget } from '../registry/chooseWidget'
import type { WidgetDefinition } from '../registry/WidgetDefinition'
import { ValueCards } from '../ValueCards/ValueCards'
import { widgets } from '../widgets'
import { WidgetCard } from './WidgetCard'

const ENTRY: CatalogueEntry = {
  label: 'battery',
  type: 'battery',
  kind: 'data',
  dataType: 'json-r2u',
  direction: 'to-operator',
  channels: [],
  delivery: 'reliable',
}

class FakeStore {
  readonly counters = new StoreCounters()
  readonly state = new Value<StoreState>({ phase: 'open' })
  readonly gap = new Value<Gap | null>(null)
  latest: { data: ArrayBuffer; info: MessageInfo } | null = null
  private readonly listeners = new Set<(data: ArrayBuffer, info: MessageInfo) => void>()
  subscribe(listener: (data: ArrayBuffer, info: MessageInfo) => void): () => void {
    this.listeners.add(listener)
    return () => this.listeners.delete(listener)
  }
  receive(value: unknown, info: Partial<MessageInfo> = {}): void {
    const data = new TextEncoder().encode(JSON.stringify(value)).buffer
    const receivedAtMs = performance.timeOrigin + performance.now()
    this.latest = { data, info: { receivedAtMs, seq: 1, stampUs: 1, latched: false, ageMs: 0, ...info } }
    for (const listener of this.listeners) listener(data, this.latest.info)
  }
  get listenerCount(): number {
    return this.listeners.size
  }
}

let store: FakeStore
let delivery: DeliveryWatch
let asked: boolean[]
let released: number
let server: Value<ServerState>

beforeEach(() => {
  vi.useFakeTimers()
  store = new FakeStore()
  asked = []
  delivery = new DeliveryWatch(({ on }) => asked.push(on) > 0)
  delivery.greeted({ delivery: 1 })
  released = 0
  server = new Value<ServerState>('online')
})

afterEach(() => {
  cleanup()
  vi.useRealTimers()
})

/** The widget that fits, with its code at hand. */
function chosen(entry: CatalogueEntry): WidgetDefinition | null {
  const widget = chooseWidget(widgets, entry)
  return widget?.id === 'value-cards' ? { ...widget, Component: ValueCards } : widget
}

function shown(entry = ENTRY, widget = chosen(entry)) {
  const connection = () => ({ delivery, catalogue: new Value(null), state: new Value<ConnectionState>({ phase: 'connected', roundTripMs: null }) })
  const storeManager = { getOrCreateStore: () => store, releaseStore: () => (released += 1) }
  return render(
    <MantineProvider env="test">
      <MosaicProvider client={{ storeManager, connection, server } as unknown as MosaicClient}>
        <WidgetCard robotId="r" entry={entry} widget={widget} alternatives={[]} onChoose={() => {}} />
      </MosaicProvider>
    </MantineProvider>,
  )
}

test('a value is shown with its age', () => {
  shown()
  act(() => store.receive({ voltage_v: 12.5 }))
  expect(screen.getByText('Voltage')).toBeTruthy()
  expect(screen.getByText('12.50')).toBeTruthy()
  act(() => void vi.advanceTimersByTime(300))
  expect(screen.getByTestId('age').textContent).toBe('live')
  act(() => void vi.advanceTimersByTime(5000))
  expect(screen.getByTestId('age').textContent).toBe('5 s ago')
})

test('a connector that answers requests has no value that could be missing', () => {
  shown({ ...ENTRY, answerSchema: {} }, chosen(ENTRY))
  expect(screen.queryByTestId('age')).toBeNull()
})

test('a repeated value is marked as latched', () => {
  shown()
  act(() => store.receive({ voltage_v: 12.5 }, { latched: true, ageMs: 4000 }))
  act(() => void vi.advanceTimersByTime(300))
  expect(screen.getByTestId('age').textContent).toBe('latched · 4 s ago')
})

test('a value whose age is not known yet never looks as if it were new', () => {
  shown()
  const info: { stampUs: number; latched: boolean; ageMs: number | null } = { stampUs: 7_000_000, latched: true, ageMs: null }
  act(() => store.receive({ voltage_v: 12.5 }, info))
  act(() => void vi.advanceTimersByTime(300))
  expect(screen.getByTestId('age').textContent).toBe('latched · age not known')
  expect(screen.getByTestId('age').dataset['state']).toBe('unknown')
  if (store.latest !== null) store.latest.info = { ...store.latest.info, ageMs: 23_000 }
  act(() => void vi.advanceTimersByTime(300))
  expect(screen.getByTestId('age').textContent).toBe('latched · 23 s ago')
  expect(screen.getByTestId('age').dataset['state']).toBe('old')
})

test('a value from before the loss of the connection is greyed and says its age', () => {
  shown()
  act(() => store.receive({ voltage_v: 12.5 }))
  act(() => store.state.set({ phase: 'reconnecting', code: 'peer.lost' }))
  act(() => void vi.advanceTimersByTime(3250))
  expect(screen.getByTestId('age').textContent).toMatch(/^reconnecting · 3\.\d s old$/)
  expect(screen.getByText('12.50').closest('[data-away]')).not.toBeNull()
  act(() => store.state.set({ phase: 'open' }))
  expect(screen.getByText('12.50').closest('[data-away]')).toBeNull()
})

test('while the connection is away, the age of the last picture counts up in the bar', () => {
  const { state, gap, counters } = store
  const camera = {
    state,
    gap,
    counters,
    mediaStream: new Value(null),
    statistics: new Value(null),
    displayedAgeMs: new Value(null),
    latestPicture: { shownAtMs: performance.timeOrigin + performance.now(), ageMs: 100 },
    setBufferTarget: () => {},
    setShown: () => {},
  }
  store = camera as unknown as FakeStore
  shown({ ...ENTRY, label: 'front', type: 'camera', kind: 'video', dataType: 'media' })
  expect(screen.queryByRole('status')).toBeNull()
  act(() => state.set({ phase: 'reconnecting', code: 'peer.lost' }))
  act(() => void vi.advanceTimersByTime(1000))
  expect(screen.getByRole('status').textContent).toBe('Reconnecting · last picture 1.1 s old')
  act(() => void vi.advanceTimersByTime(2000))
  expect(screen.getByRole('status').textContent).toBe('Reconnecting · last picture 3.1 s old')
})

test('messages that were lost are told for a while', () => {
  shown()
  act(() => store.gap.set({ lost: 3, sent: false, atMs: performance.timeOrigin + performance.now() }))
  expect(screen.getByText('3 messages were lost while the connection was away')).toBeTruthy()
  act(() => void vi.advanceTimersByTime(11_000))
  expect(screen.queryByText(/were lost/)).toBeNull()
})

test('a label that the robot does not know is shown with the nearest one', () => {
  store.state.set({ phase: 'mismatch', code: 'channel.unknown_label', nearest: 'battery_1' })
  shown()
  expect(screen.getByText("The robot has no connector 'battery'")).toBeTruthy()
  expect(screen.getByText(/Did you mean 'battery_1'/)).toBeTruthy()
})

test('a closed channel says why and keeps the last value', () => {
  shown()
  act(() => store.receive({ voltage_v: 12.5 }))
  act(() => store.state.set({ phase: 'closed', code: 'peer.lost' }))
  expect(screen.getByText(/fell silent/)).toBeTruthy()
  expect(screen.getByText('12.50')).toBeTruthy()
})

test('a connector that nothing shows is said', () => {
  shown({ ...ENTRY, dataType: 'byte-u2r' })
  expect(screen.getByText('No widget shows byte-u2r')).toBeTruthy()
})

test('a widget that fails is named and can be tried again', () => {
  vi.spyOn(console, 'error').mockImplementation(() => {})
  const broken = widgets[0]
  if (broken === undefined) throw new Error('no widget')
  shown(ENTRY, {
    ...broken,
    title: 'Broken',
    Component: () => {
      throw new Error('no canvas')
    },
  })
  expect(screen.getByText('Broken failed')).toBeTruthy()
  vi.restoreAllMocks()
})

const ROW: DeliveryRow = {
  label: 'battery', delivery: 'reliable', messages: 1200, rateHz: 10, bytesPerS: 1500, queueMessages: 3, queueBytes: 4500,
  replaced: 0, dropped: 7, tooLarge: 5, thinned: 2, refused: 0, lost: 0, resent: 1, ageMs: 40,
} // prettier-ignore

function later(seconds: number): void {
  act(() => void vi.advanceTimersByTime(seconds * 1000))
}

test('a card marks that messages are being dropped, and no longer once they are not', () => {
  shown()
  expect(asked).toEqual([true])
  act(() => delivery.heard({ connectors: [ROW] }))
  later(2)
  expect(screen.queryByTestId('drop-mark')).toBeNull()
  act(() => delivery.heard({ connectors: [{ ...ROW, dropped: 8 }] }))
  later(1)
  expect(screen.getByTestId('drop-mark')).toBeTruthy()
  later(6)
  expect(screen.queryByTestId('drop-mark')).toBeNull()
})

test('a card says that its connector fails and why, and no longer once it is back', () => {
  shown()
  const age = () => screen.getByTestId('age').textContent
  later(1)
  expect([age(), screen.queryByRole('status')]).toEqual(['no value yet', null])
  act(() => delivery.heard({ connectors: [{ ...ROW, failureCode: 'plugin.no_device', triesAgainInS: 7 }] }))
  expect(age()).toBe('failed')
  expect(screen.getByRole('status').textContent).toMatch(/^It fails \(plugin\.no_device\): The connector's device isn't available/)
  expect(screen.getByRole('status').dataset['beside']).toBe('true')
  act(() => delivery.heard({ connectors: [{ ...ROW, failureCode: 'plugin.failed' }] }))
  expect(screen.getByRole('status').textContent).toContain('(plugin.failed)')
  act(() => store.receive({ voltage_v: 12.5 }))
  later(5)
  expect(age()).toBe('5 s ago')
  act(() => delivery.heard({ connectors: [ROW] }))
  expect(screen.queryByRole('status')).toBeNull()
})

test('a failure of which nothing is known any more is no longer told', () => {
  shown()
  act(() => delivery.heard({ connectors: [{ ...ROW, failureCode: 'plugin.failed' }] }))
  act(() => store.state.set({ phase: 'closed', code: 'peer.lost' }))
  expect(screen.getByRole('status').textContent).toMatch(/fell silent/)
  act(() => delivery.lost())
  act(() => store.state.set({ phase: 'open' }))
  expect(screen.queryByRole('status')).toBeNull()
})

test('a robot that was offline is not to be started while the server is away', () => {
  shown()
  act(() => store.state.set({ phase: 'closed', code: 'signal.robot_offline' }))
  expect(screen.getByRole('status').textContent).toContain('mosaic run')
  act(() => server.set('offline'))
  expect(screen.getByRole('status').textContent).toBe("The server can't be reached. Check the server's address and the network.")
  act(() => server.set('online'))
  expect(screen.getByRole('status').textContent).toContain('mosaic run')
})

test('the details tell what the robot counts and what this page does', async () => {
  shown()
  act(() => delivery.heard({ connectors: [ROW] }))
  store.counters.missed = 4
  act(() => screen.getByRole('button', { name: 'Menu of battery' }).click())
  await act(() => vi.advanceTimersByTimeAsync(500))
  act(() => screen.getByText('Delivery').click())
  await act(() => vi.advanceTimersByTimeAsync(1500))
  const cells = (name: string) => [...screen.getByRole('row', { name: new RegExp(`^${name}`) }).children].map((cell) => cell.textContent)
  expect(cells('rate')).toEqual(['rate', '10.0/s · 1.5 KB/s', '0.0/s · 0 B/s'])
  expect(cells('queue full')).toEqual(['queue full', '7', '–'])
  expect(cells('too large')).toEqual(['too large', '5', '–'])
  expect(cells('queue 3')).toEqual(['queue', '3 · 4.5 KB', '–'])
  expect(cells('missed')).toEqual(['missed', '–', '4'])
})

test('the store is given back when the card leaves', () => {
  shown().unmount()
  expect(released).toBe(1)
  expect(asked).toEqual([true, false])
  expect(store.listenerCount).toBe(0)
})
