import { messages, type CatalogueEntry } from '@mosaic/client'
import { cleanup, fireEvent, render, screen } from '@testing-library/react'
import userEvent from '@testing-library/user-event'
import { act } from 'react'
import { afterEach, beforeEach, expect, test } from 'vitest'
import { FakeConnection, WithRobot } from '../../test/fakeRobot'
import { FakeStore, storesOf } from '../../test/fakeStore'
import { GripperCommand } from './GripperCommand'
import { JointCommand } from './JointCommand'
import { typedNumber } from './jointDraft'

const { JointState, JointTarget, GripperTarget } = messages.SCHEMA_IDS
const TARGET: CatalogueEntry = { label: 'move', type: 'x', kind: 'data', dataType: 'json-u2r', direction: 'to-robot', channels: [], delivery: 'latest', schemaId: JointTarget }
const STATE: CatalogueEntry = { ...TARGET, label: 'arm', dataType: 'json-r2u', direction: 'to-operator', schemaId: JointState }

let commands: FakeStore
let joints: FakeStore
beforeEach(() => {
  commands = new FakeStore()
  joints = new FakeStore()
})
afterEach(cleanup)

function shown(entry: CatalogueEntry, hasState = true): void {
  const connection = new FakeConnection()
  connection.catalogue.set({ hash: '', entries: hasState ? [entry, STATE] : [entry] })
  const Widget = entry.schemaId === GripperTarget ? GripperCommand : JointCommand
  render(
    <WithRobot connection={connection} client={storesOf({ arm: joints })}>
      <Widget robotId="r" entry={entry} store={commands.asStore} />
    </WithRobot>,
  )
}

const slide = (name: string, value: number) => fireEvent.change(screen.getByRole('slider', { name }), { target: { value: String(value) } })
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
  expect(screen.getByRole('slider', { name: 'base' })).toBeTruthy()
  cleanup()
  shown(TARGET, false)
  expect(screen.getByRole('textbox', { name: 'Message to move' })).toBeTruthy()
})

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
  expect(screen.getByRole<HTMLInputElement>('slider', { name: 'Opening' }).max).toBe('0.08')
  slide('Opening', 0.05)
  await move()
  await userEvent.type(screen.getByRole('textbox', { name: 'Press at most (N)' }), '0')
  await move()
  expect(commands.sent).toEqual([{ position: 0.05 }, { position: 0.05, max_effort: 0 }])
})

test.each([['', null], ['x', null], ['0', null], ['1,5', 1.5], [' 2 ', 2]])('%j is the duration %s', (text, value) =>
  expect(typedNumber(text, 0)).toBe(value),
)
