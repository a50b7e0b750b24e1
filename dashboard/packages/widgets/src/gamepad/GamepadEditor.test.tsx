import { act, cleanup, render, screen, waitFor } from '@testing-library/react'
import userEvent from '@testing-library/user-event'
import { afterEach, beforeEach, expect, test, vi } from 'vitest'
import { fakeGamepads, setPressed, type FakeGamepads } from '../../test/fakeGamepads'
import { FakeConnection, WithRobot } from '../../test/fakeRobot'
import GamepadEditor from './GamepadEditor'
import { gamepadHint } from './gamepadHint'
import { STANDARD_MAPPING } from './gamepadMapping'
import { GamepadSource } from './GamepadSource'

let pads: FakeGamepads
let source: GamepadSource
let closed: number

beforeEach(() => {
  localStorage.clear()
  pads = fakeGamepads()
  source = new GamepadSource()
  closed = 0
})

afterEach(() => {
  cleanup()
  source.dispose()
  pads.restore()
  vi.restoreAllMocks()
})

function shown(): void {
  render(
    <WithRobot connection={new FakeConnection()}>
      <GamepadEditor source={source} onClose={() => (closed += 1)} />
    </WithRobot>,
  )
}

test('without a gamepad it says how to wake one, and notices it', async () => {
  shown()
  expect(screen.getByRole('status').textContent).toContain('Press any button')
  act(() => void pads.plugIn())
  expect(await screen.findByText('Xbox 360 Controller')).toBeTruthy()
})

test('what the sticks report is shown live, as the robot would get it', async () => {
  const pad = pads.plugIn()
  shown()
  pad.axes[1] = -1
  expect(await screen.findByRole('img', { name: '100 % ahead' })).toBeTruthy()
  pad.axes[1] = 0.05
  expect(await screen.findByRole('img', { name: '0 % ahead' })).toBeTruthy()
})

test('a button is chosen by pressing it, and kept for this kind of gamepad', async () => {
  const pad = pads.plugIn()
  shown()
  await screen.findByText('left shoulder (LB)')
  await userEvent.click(screen.getByRole('button', { name: 'Hold to drive: choose a button' }))
  setPressed(pad, 5, true)
  expect(await screen.findByText('right shoulder (RB)')).toBeTruthy()
  await userEvent.click(screen.getByRole('button', { name: 'Save' }))
  expect(closed).toBe(1)
  expect(source.active.get()?.mapping.deadManButton).toBe(5)
  expect(new GamepadSource().active.get()?.mapping.deadManButton).toBe(5)
})

test('cancelled, nothing changes', async () => {
  pads.plugIn()
  shown()
  await userEvent.click(await screen.findByRole('button', { name: 'Stop the robot: no button' }))
  await userEvent.click(screen.getByRole('button', { name: 'Cancel' }))
  expect(source.active.get()?.mapping).toEqual(STANDARD_MAPPING)
})

test('a dead-man button that is needed but not chosen is said', async () => {
  pads.plugIn()
  shown()
  await userEvent.click(await screen.findByRole('button', { name: 'Hold to drive: no button' }))
  expect(screen.getByText(/this gamepad will not drive/)).toBeTruthy()
})

test('a gamepad that the browser does not know drives only after it was looked at', async () => {
  pads.plugIn({ id: 'Joystick', mapping: '' })
  shown()
  expect(screen.getByText(/until then it does not drive/)).toBeTruthy()
  expect(source.active.get()?.isTrusted).toBe(false)
  await userEvent.click(screen.getByRole('button', { name: 'Save' }))
  expect(source.active.get()?.isTrusted).toBe(true)
})

test('a browser that remembers nothing says so, and uses the mapping all the same', async () => {
  pads.plugIn()
  const forbidden = new GamepadSource({
    storage: {
      getItem: () => null,
      setItem: () => {
        throw new Error('full')
      },
      removeItem: () => {},
    },
  })
  source.dispose()
  source = forbidden
  shown()
  await userEvent.click(await screen.findByRole('button', { name: 'Stop the robot: no button' }))
  await userEvent.click(screen.getByRole('button', { name: 'Save' }))
  await waitFor(() => expect(screen.getByText(/can’t remember the mapping/)).toBeTruthy())
  expect(source.active.get()?.mapping.stopButton).toBeNull()
})

test.each([
  [{}, 'Xbox 360 Controller: hold left shoulder (LB) to drive. B (○) stops the robot.'],
  [{ isTrusted: false }, 'Xbox 360 Controller is not known here: look at its mapping once, then it drives.'],
  [{ mapping: { ...STANDARD_MAPPING, needsDeadMan: false, stopButton: null } }, 'Xbox 360 Controller drives with its sticks.'],
  [{ mapping: { ...STANDARD_MAPPING, deadManButton: null, stopButton: null } }, 'Xbox 360 Controller has no dead-man button chosen and does not drive.'],
])('with %j the pad says “%s”', (change, text) => {
  pads.plugIn()
  const active = new GamepadSource().active.get()
  if (active === null) throw new Error('no gamepad')
  expect(gamepadHint({ ...active, ...change })).toBe(text)
})
