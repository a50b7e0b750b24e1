import { MantineProvider } from '@mantine/core'
import { Value, type CatalogueEntry, type Refusal, type StoreState } from '@mosaic/client'
import { act, cleanup, fireEvent, render, screen } from '@testing-library/react'
import { afterEach, beforeEach, expect, test, vi } from 'vitest'
import type { AnyStore } from '../stores/storeKinds'
import { DrivePad } from './DrivePad'
import { ZERO_TWIST, type Twist } from './driveControl'

const ENTRY: CatalogueEntry = {
  label: 'cmd_vel',
  type: 'cmd-vel',
  kind: 'data',
  dataType: 'json-u2r',
  direction: 'to-robot',
  channels: [],
  delivery: 'latest',
  widget: 'drive-pad',
  safety: { max_linear_mps: 2, max_angular_radps: 4 },
}

class FakeStore {
  readonly state = new Value<StoreState>({ phase: 'open' })
  readonly lastRefusal = new Value<Refusal | null>(null)
  readonly sent: Twist[] = []
  sendData(text: string): boolean {
    this.sent.push(JSON.parse(text) as Twist)
    return true
  }
}

let store: FakeStore

beforeEach(() => {
  // No workers in this environment: the pad falls back to the page's timer.
  vi.stubGlobal('Worker', undefined)
  vi.useFakeTimers()
  store = new FakeStore()
  vi.spyOn(HTMLElement.prototype, 'getBoundingClientRect').mockReturnValue(new DOMRect(0, 0, 200, 200))
  vi.spyOn(HTMLElement.prototype, 'setPointerCapture').mockImplementation(() => {})
  vi.spyOn(HTMLElement.prototype, 'hasPointerCapture').mockReturnValue(true)
})

afterEach(() => {
  cleanup()
  vi.useRealTimers()
  vi.restoreAllMocks()
  vi.unstubAllGlobals()
})

function shownPad() {
  const view = render(
    <MantineProvider>
      <DrivePad robotId="r" entry={ENTRY} store={store as unknown as AnyStore} />
    </MantineProvider>,
  )
  return { ...view, pad: screen.getByTestId('drive-pad') }
}

const AHEAD = { clientX: 100, clientY: 10, isPrimary: true, button: 0, pointerId: 1 }

test('a finger on the pad drives within the limits of the catalogue', () => {
  const { pad } = shownPad()
  fireEvent.pointerDown(pad, AHEAD)
  expect(store.sent.at(-1)?.linear.x).toBeCloseTo(1) // 2 m/s at half speed
  expect(screen.getByTestId('drive-status').textContent).toBe('Driving')
  expect(screen.getByTestId('velocity').textContent).toBe('1.00 m/s · 0.00 rad/s')
})

test('moving the finger turns; it is sent with the next tick', () => {
  const { pad } = shownPad()
  fireEvent.pointerDown(pad, AHEAD)
  fireEvent.pointerMove(pad, { ...AHEAD, clientX: 10, clientY: 100 })
  act(() => void vi.advanceTimersByTime(50))
  expect(store.sent.at(-1)?.angular.z).toBeCloseTo(2)
})

test.each([
  ['lifted', (pad: HTMLElement) => fireEvent.pointerUp(pad, AHEAD)],
  ['taken over by the system', (pad: HTMLElement) => fireEvent.pointerCancel(pad, AHEAD)],
  ['no longer captured', (pad: HTMLElement) => fireEvent.lostPointerCapture(pad, AHEAD)],
])('the robot stops at once when the finger is %s', (_name, end) => {
  const { pad } = shownPad()
  fireEvent.pointerDown(pad, AHEAD)
  end(pad)
  expect(store.sent.at(-1)).toEqual(ZERO_TWIST)
})

test('the robot stops at once when the pad leaves the page', () => {
  const { pad, unmount } = shownPad()
  fireEvent.pointerDown(pad, AHEAD)
  unmount()
  expect(store.sent.at(-1)).toEqual(ZERO_TWIST)
})

test('a lost connection ends the hold, and the finger must come down anew', () => {
  const { pad } = shownPad()
  fireEvent.pointerDown(pad, AHEAD)
  act(() => store.state.set({ phase: 'closed' }))
  expect(store.sent.at(-1)).toEqual(ZERO_TWIST)
  const count = store.sent.length
  act(() => store.state.set({ phase: 'open' }))
  act(() => void vi.advanceTimersByTime(1000))
  expect(store.sent).toHaveLength(count)
  expect(screen.getByTestId('drive-status').textContent).toContain('connection was lost')
})

test('a second finger and the other mouse buttons do nothing', () => {
  const { pad } = shownPad()
  fireEvent.pointerDown(pad, { ...AHEAD, isPrimary: false })
  fireEvent.pointerDown(pad, { ...AHEAD, button: 2 })
  expect(store.sent).toEqual([])
})

test('a refused command is shown with its reason, and forgotten after a while', () => {
  shownPad()
  act(() => store.lastRefusal.set({ label: 'cmd_vel', code: 'safety.stale' }))
  expect(screen.getByTestId('drive-status').textContent).toContain('too old')
  act(() => void vi.advanceTimersByTime(5000))
  expect(screen.getByTestId('drive-status').textContent).toBe('Ready')
})
