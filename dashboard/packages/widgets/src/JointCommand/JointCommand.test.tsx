import { messages, type CatalogueEntry } from '@mosaic/client'
import { act, cleanup, fireEvent, render, screen } from '@testing-library/react'
import userEvent from '@testing-library/user-event'
import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest'
import { FakeConnection, WithRobot } from '../../test/fakeRobot'
import { FakeStore, storesOf } from '../../test/fakeStore'
import { GripperCommand } from './GripperCommand'
import { JointCommand } from './JointCommand'
import { ofNames, typedNumber } from './jointDraft'
import { repeatPeriodS } from './useKeptTarget'

const { JointState, JointTarget, GripperTarget } = messages.SCHEMA_IDS
const TARGET: CatalogueEntry = { label: 'move', type: 'x', connector: 'arm', kind: 'data', dataType: 'json-u2r', direction: 'to-robot', channels: [], delivery: 'latest', schemaId: JointTarget }
const STATE: CatalogueEntry = { ...TARGET, label: 'arm', dataType: 'json-r2u', direction: 'to-operator', schemaId: JointState }

let commands: FakeStore
let joints: FakeStore
beforeEach(() => {
  commands = new FakeStore()
  joints = new FakeStore()
})
afterEach(cleanup)

function shown(entry: CatalogueEntry, hasState = true): FakeConnection {
  const connection = new FakeConnection()
  connection.catalogue.set({ hash: '', entries: hasState ? [entry, STATE] : [entry] })
  const Widget = entry.schemaId === GripperTarget ? GripperCommand : JointCommand
  render(
    <WithRobot connection={connection} client={storesOf({ arm: joints })}>
      <Widget robotId="r" entry={entry} store={commands.asStore} />
    </WithRobot>,
  )
  return connection
}

const slide = (name: string, value: number) => fireEvent.change(screen.getByRole('slider', { name }), { target: { value: String(value) } })
const type = (name: string, text: string) => fireEvent.change(screen.getByRole('textbox', { name }), { target: { value: text } })
const move = () => userEvent.click(screen.getByRole('button', { name: 'Move' }))

test('sliders begin where the joints stand, and only what was touched is sent', async () => {
  shown({ ...TARGET, safety: { limits: { 'positions.elbow': { min: 0, max: 2 } } } })
  joints.say({ names: ['elbow', 'wrist'], positions: [0.5, -0.25], velocities: [], efforts: [] })
  expect(screen.getByRole<HTMLInputElement>('slider', { name: 'elbow' }).value).toBe('0.5')
  expect(screen.getByRole<HTMLInputElement>('slider', { name: 'elbow' }).max).toBe('2')
  expect(screen.getByRole<HTMLButtonElement>('button', { name: 'Move' }).disabled).toBe(true)
  slide('wrist', 1)
  await userEvent.type(screen.getByRole('textbox', { name: 'Be there in (s)' }), '2,5')
  await move()
  expect(commands.sent).toEqual([{ names: ['wrist'], positions: [1], duration_s: 2.5 }])
  expect(screen.getByRole('status').textContent).toBe('Sent')
  expect(screen.getByText('-0.250 rad')).toBeTruthy()
})

test('what was touched before it is known where the joints are stays touched', () => {
  const entry = { ...TARGET, safety: { limits: { 'positions.elbow': { min: 0, max: 2 } } } }
  const connection = shown(entry, false)
  type('elbow', '1,5')
  act(() => connection.catalogue.set({ hash: '', entries: [entry, STATE] }))
  joints.say({ names: ['elbow'], positions: [0.5], velocities: [], efforts: [] })
  expect(screen.getByText('1.500 rad')).toBeTruthy()
})

test('what was touched can be taken back', async () => {
  shown(TARGET)
  joints.say({ names: ['elbow'], positions: [0.5], velocities: [], efforts: [] })
  slide('elbow', 1)
  await userEvent.click(screen.getByRole('button', { name: 'Undo' }))
  expect(screen.getByText('0.500 rad')).toBeTruthy()
  expect(commands.sent).toEqual([])
})

test('what the link did not take stays set', async () => {
  shown(TARGET)
  joints.say({ names: ['elbow'], positions: [0.5], velocities: [], efforts: [] })
  slide('elbow', 1)
  commands.takes = false
  await move()
  expect(screen.getByRole('status').textContent).toBe('The link did not take it; try again')
  expect(screen.getByText('1.000 rad')).toBeTruthy()
})

test('without a report the joints are those that the limits name; without either a person writes them', () => {
  shown({ ...TARGET, safety: { limits: { 'positions.base': { min: -1, max: 1 } } } }, false)
  expect(screen.getByRole('textbox', { name: 'base' })).toBeTruthy()
  cleanup()
  shown(TARGET, false)
  expect(screen.getByRole('textbox', { name: 'Message to move' })).toBeTruthy()
})

test('only the joints that the connector takes are shown, and those of another arm never', async () => {
  const entry = { ...TARGET, connector: undefined, itemNames: ['base', 'lift'] }
  shown(entry)
  joints.say({ names: ['mast_pan', 'mast_tilt', 'base'], positions: [0.1, 0.2, 0.3] })
  expect(screen.queryAllByRole('slider')).toEqual([])
  expect(screen.getAllByText('not set')).toHaveLength(2)
  joints.say({ names: ['mast_pan', 'lift', 'base'], positions: [0.1, 0.2, 0.3] })
  const sliders = await screen.findAllByRole('slider')
  expect(sliders.map((slider) => slider.getAttribute('aria-valuetext'))).toEqual(['0.300 rad', '0.200 rad'])
})

test('where nobody knows where a joint stands a number is typed, and no key sends it to a made-up place', async () => {
  shown({ ...TARGET, itemNames: ['base', 'lift'], safety: { limits: { 'positions.base': { min: -1, max: 1 } } } }, false)
  await userEvent.type(screen.getByRole('textbox', { name: 'base' }), '{ArrowUp}{ArrowRight}')
  expect(screen.getByRole<HTMLButtonElement>('button', { name: 'Move' }).disabled).toBe(true)
  for (const wrong of ['2', '-', 'x', '1.5.2']) {
    type('base', wrong)
    expect(screen.getByRole('textbox', { name: 'base' }).getAttribute('aria-invalid')).toBe('true')
    expect(screen.getByRole<HTMLButtonElement>('button', { name: 'Move' }).disabled).toBe(true)
  }
  type('base', '-0,5')
  await move()
  expect(commands.sent).toEqual([{ names: ['base'], positions: [-0.5] }])
  expect(screen.getByRole<HTMLInputElement>('textbox', { name: 'base' }).value).toBe('')
  type('base', '')
  expect(screen.getByRole('textbox', { name: 'base' }).getAttribute('aria-invalid')).toBeNull()
})

test('what was touched of a joint that is shown no more is not sent', () =>
  expect(ofNames({ elbow: 1, wrist: 2 }, ['wrist', 'base'])).toEqual({ wrist: 2 }))

test('nothing is sent while somebody else commands, and why is said', () => {
  shown(TARGET)
  joints.say({ names: ['elbow'], positions: [0.5], velocities: [], efforts: [] })
  slide('elbow', 1)
  act(() => commands.sendBlocked.set({ code: 'lease.not_holder' }))
  expect(screen.getByRole<HTMLButtonElement>('button', { name: 'Move' }).disabled).toBe(true)
  expect(screen.getByRole('status').textContent).not.toBe('')
})

test('a gripper opens within its limits, and presses as hard as it is told', async () => {
  shown({ ...TARGET, label: 'hand', schemaId: GripperTarget, safety: { limits: { position: { max: 0.08 } } } })
  type('Opening', '0,05')
  await move()
  await userEvent.type(screen.getByRole('textbox', { name: 'Press at most (N)' }), '0')
  await move()
  expect(commands.sent).toEqual([{ position: 0.05 }, { position: 0.05, max_effort: 0 }])
})

test('a gripper stays where it is, whatever key is pressed, until a number is typed or an end is taken', async () => {
  shown({ ...TARGET, label: 'hand', schemaId: GripperTarget, safety: { limits: { position: { max: 0.08 } } } })
  const button = screen.getByRole<HTMLButtonElement>('button', { name: 'Move' })
  expect(screen.queryByRole('slider')).toBeNull()
  await userEvent.type(screen.getByRole('textbox', { name: 'Opening' }), '{ArrowUp}{ArrowRight}')
  expect([button.disabled, commands.sent]).toEqual([true, []])
  expect(screen.getByText('not set')).toBeTruthy()
  type('Opening', '0,09')
  expect(button.disabled).toBe(true)
  for (const end of ['Open', 'Shut']) {
    await userEvent.click(screen.getByRole('button', { name: end }))
    await move()
  }
  expect(commands.sent).toEqual([{ position: 0.08 }, { position: 0 }])
  expect(screen.getByRole<HTMLInputElement>('textbox', { name: 'Opening' }).value).toBe('0')
})

test('how far a gripper opens at most is not guessed', () => {
  shown({ ...TARGET, label: 'hand', schemaId: GripperTarget })
  expect(screen.queryByRole('button', { name: 'Open' })).toBeNull()
  expect(screen.getByRole('button', { name: 'Shut' })).toBeTruthy()
})

test.each([['', null], ['x', null], ['0', null], ['1,5', 1.5], [' 2 ', 2]])('%j is the duration %s', (text, value) =>
  expect(typedNumber(text, 0)).toBe(value),
)

describe('a robot that holds still on silence', () => {
  const IMPATIENT = { ...TARGET, safety: { timeout_s: 0.3 } }
  const stand = (position: number) => joints.say({ names: ['elbow'], positions: [position], velocities: [], efforts: [] })
  const wait = (ms: number) => act(() => void vi.advanceTimersByTime(ms))
  const press = (name: string) => fireEvent.click(screen.getByRole('button', { name }))
  beforeEach(() => vi.useFakeTimers({ toFake: ['setInterval', 'clearInterval', 'setTimeout', 'clearTimeout', 'requestAnimationFrame', 'cancelAnimationFrame', 'performance'] }))
  afterEach(() => vi.useRealTimers())

  function moving(): void {
    shown(IMPATIENT)
    stand(0)
    slide('elbow', 1)
    press('Move')
  }

  test('is told its target until it is there', () => {
    moving()
    wait(500)
    expect(commands.sent).toHaveLength(6)
    stand(0.99)
    wait(500)
    expect(commands.sent).toHaveLength(6)
    expect(screen.queryByRole('button', { name: 'Hold' })).toBeNull()
  })

  test('is told what is left of the time that a person set', () => {
    shown(IMPATIENT)
    stand(0)
    slide('elbow', 1)
    fireEvent.change(screen.getByRole('textbox', { name: 'Be there in (s)' }), { target: { value: '2' } })
    press('Move')
    wait(500)
    const told = commands.sent.map((one) => (one as { duration_s: number }).duration_s)
    expect(told[0]).toBe(2)
    expect(told.at(-1)).toBeCloseTo(1.5)
  })

  test('is not kept moving for ever if it does not get there', () => {
    moving()
    wait(11_000)
    const told = commands.sent.length
    wait(1000)
    expect(commands.sent).toHaveLength(told)
  })

  test('goes on to an earlier target while a later one is on its way', () => {
    shown(IMPATIENT)
    joints.say({ names: ['elbow', 'wrist'], positions: [0, 0], velocities: [], efforts: [] })
    slide('elbow', 1)
    press('Move')
    slide('wrist', 0.5)
    press('Move')
    wait(100)
    expect(commands.sent.at(-1)).toEqual({ names: ['elbow', 'wrist'], positions: [1, 0.5] })
  })

  test.each<[string, () => void]>([
    ['Hold is pressed', () => press('Hold')],
    ['the window loses the focus', () => fireEvent.blur(window)],
    ['the page is hidden', () => fireEvent(document, new Event('visibilitychange'))],
    ['somebody says stop', () => commands.sendBlocked.set({ code: 'safety.stopped' })],
    ['the robot refuses it', () => commands.lastRefusal.set({ label: 'move', code: 'lease.expired', gate: 'lease' })],
    ['the connection is away', () => commands.state.set({ phase: 'reconnecting' })],
    ['the card is gone', cleanup],
  ])('hears no more when %s', (_, ends) => {
    moving()
    wait(200)
    act(ends)
    const told = commands.sent.length
    wait(1000)
    expect(told).toBe(3)
    expect(commands.sent).toHaveLength(told)
  })

  test('goes on when one of many came too late', () => {
    moving()
    act(() => commands.lastRefusal.set({ label: 'move', code: 'safety.stale', gate: 'age' }))
    wait(200)
    expect(commands.sent).toHaveLength(3)
  })

  test('opens its gripper for so long as any gripper takes', () => {
    shown({ ...IMPATIENT, label: 'hand', schemaId: GripperTarget })
    type('Opening', '0.02')
    press('Move')
    wait(5000)
    expect(commands.sent.length).toBeGreaterThan(25)
    expect(commands.sent.length).toBeLessThan(35)
    expect(screen.queryByRole('button', { name: 'Hold' })).toBeNull()
  })
})

test.each([[undefined, null], [{}, null], [{ timeout_s: 0.3 }, 0.1], [{ timeout_s: 0.15 }, 0.05], [{ timeout_s: 5 }, 0.1]])(
  'with %j a target is said every %s s',
  (safety, periodS) => expect(repeatPeriodS(safety)?.toFixed(3)).toBe(periodS?.toFixed(3)),
)
