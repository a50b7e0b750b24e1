import { Value, type CatalogueEntry, type Refusal, type StoreState } from '@mosaic/client'
import { act, cleanup, fireEvent, render, screen } from '@testing-library/react'
import { afterEach, beforeEach, expect, test, vi } from 'vitest'
import { ALICE, ALICES, FakeConnection, FREE, ME, MINE, WithRobot } from '../../test/fakeRobot'
import { StopButton } from '../control/StopButton'
import { addPicture } from '../frame/picturesInSight'
import type { AnyStore } from '../stores/storeKinds'
import { DrivePad } from './DrivePad'
import { ZERO_TWIST, type Twist } from './driveTwist'

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
let connection: FakeConnection

beforeEach(() => {
  // No workers in this environment: the pad falls back to the page's timer.
  vi.stubGlobal('Worker', undefined)
  vi.useFakeTimers()
  store = new FakeStore()
  connection = new FakeConnection()
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

const LEASED: CatalogueEntry = { ...ENTRY, safety: { ...ENTRY.safety, requires_lease: true, resource: 'motion' } }

function shownPad(entry = ENTRY) {
  const view = render(
    <WithRobot connection={connection}>
      <DrivePad robotId="r" entry={entry} store={store as unknown as AnyStore} />
    </WithRobot>,
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

const statusText = () => screen.getByTestId('drive-status').textContent

test('touching the pad while nobody commands takes control; motion begins with the grant', () => {
  const { pad } = shownPad(LEASED)
  expect(statusText()).toBe('Touch to take control')
  fireEvent.pointerDown(pad, AHEAD)
  expect(connection.control.said).toEqual([['request', 'motion']])
  expect(store.sent).toEqual([])
  act(() => connection.control.setLease(MINE))
  expect(store.sent.at(-1)?.linear.x).toBeCloseTo(1)
})

test.each([
  ['somebody else commands', () => connection.control.setLease(ALICES), 'Alice has control'],
  ['this page observes', () => connection.control.me.set({ ...ME, role: 'observer' }), 'observer: you may watch, and stop'],
  ['the robot is stopped', () => connection.control.stopState.set({ isStopped: true, by: 'Bob', reason: '', mine: null }), 'Stopped by Bob'],
  [
    'its request waits',
    () => connection.control.setLease({ ...ALICES, request: { phase: 'queued', place: 1, code: 'lease.queued' } }),
    'Waiting for Alice',
  ],
])('the pad says why it does nothing while %s', (_name, arrange, text) => {
  arrange()
  const { pad } = shownPad(LEASED)
  expect(statusText()).toContain(text)
  expect(pad.getAttribute('aria-disabled')).toBe('true')
  fireEvent.pointerDown(pad, AHEAD)
  expect([store.sent, connection.control.said]).toEqual([[], []])
})

test('who may no longer stop is not told that it may', () => {
  connection.control.me.set({ ...ME, role: 'observer', mayStop: false })
  shownPad(LEASED)
  expect(statusText()).toBe('Your role is observer: you may watch')
})

test('who may only watch is not told which keys drive', () => {
  shownPad(LEASED)
  expect(screen.getByText(/Hold WASD/)).toBeDefined()
  act(() => connection.control.me.set({ ...ME, role: 'observer' }))
  expect(screen.queryByText(/Hold WASD/)).toBeNull()
})

test('losing control while driving ends the hold, in silence', () => {
  connection.control.setLease(MINE)
  const { pad } = shownPad(LEASED)
  fireEvent.pointerDown(pad, AHEAD)
  const count = store.sent.length
  act(() => connection.control.setLease({ ...ALICES, holder: ALICE, ended: { code: 'lease.taken_over' } }))
  act(() => void vi.advanceTimersByTime(1000))
  expect(store.sent).toHaveLength(count)
  act(() => connection.control.setLease(MINE))
  act(() => void vi.advanceTimersByTime(1000))
  expect(store.sent).toHaveLength(count)
})

test('a pad whose leading picture leaves the screen stops the robot, and does not drive until it is back', () => {
  const picture = document.createElement('div')
  const take = addPicture('r', picture)
  let uppermost: Element = picture
  vi.spyOn(document, 'elementFromPoint').mockImplementation(() => uppermost)
  const { pad } = shownPad()
  fireEvent.pointerDown(pad, AHEAD)
  expect(store.sent.at(-1)?.linear.x).toBeCloseTo(1)
  uppermost = document.body
  act(() => void vi.advanceTimersByTime(1000))
  expect(store.sent.at(-1)).toEqual(ZERO_TWIST)
  expect(statusText()).toContain('not on the screen')
  act(() => void vi.advanceTimersByTime(2000))
  const count = store.sent.length
  fireEvent.pointerDown(pad, AHEAD)
  expect(store.sent).toHaveLength(count)
  uppermost = picture
  act(() => void vi.advanceTimersByTime(1000))
  fireEvent.pointerDown(pad, AHEAD)
  expect(store.sent.at(-1)?.linear.x).toBeCloseTo(1)
  take()
})

test('an original robot needs no lease', () => {
  connection.control.availability.set('unavailable')
  connection.control.leases.set({ motion: FREE })
  const { pad } = shownPad(LEASED)
  fireEvent.pointerDown(pad, AHEAD)
  expect(store.sent).toHaveLength(1)
})

test('how the robot limits the speed is said, with its cause', () => {
  shownPad()
  expect(screen.queryByTestId('speed-limit')).toBeNull()
  act(() => connection.control.limits.set({ cmd_vel: { label: 'cmd_vel', factor: 0.6, causes: [{ cause: 'rtt', value: 320, factor: 0.6 }] } }))
  expect(screen.getByTestId('speed-limit').textContent).toBe('Slowed to 60 %: the link is slow (round trip 320 ms)')
})

test('toward a robot that knows no stop the stop is zeros for a second, then silence', () => {
  connection.control.availability.set('unavailable')
  const { pad } = shownPad()
  render(
    <WithRobot connection={connection}>
      <StopButton robotId="r" />
    </WithRobot>,
  )
  fireEvent.pointerDown(pad, AHEAD)
  const before = store.sent.length
  fireEvent.pointerDown(screen.getByTestId('stop'), { button: 0 })
  act(() => void vi.advanceTimersByTime(3000))
  const zeros = store.sent.slice(before)
  expect(zeros.length).toBeGreaterThan(10)
  expect(zeros.length).toBeLessThanOrEqual(20)
  expect(zeros).toEqual(zeros.map(() => ZERO_TWIST))
})
