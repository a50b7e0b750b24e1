import { Value, type CatalogueEntry, type PeerView, type Refusal, type SendBlock, type StoreState } from '@mosaic/client'
import { act, cleanup, render, screen } from '@testing-library/react'
import userEvent from '@testing-library/user-event'
import { afterEach, expect, test } from 'vitest'
import { FakeConnection, WithRobot } from '../../test/fakeRobot'
import type { AnyStore } from '../stores/storeKinds'
import { JsonSender } from './JsonSender'

const ENTRY: CatalogueEntry = {
  label: 'arm',
  type: 'arm',
  kind: 'data',
  dataType: 'string-u2r',
  direction: 'to-robot',
  channels: [],
  delivery: 'reliable',
}

class FakeStore {
  readonly state = new Value<StoreState>({ phase: 'open' })
  readonly lastRefusal = new Value<Refusal | null>(null)
  readonly sendBlocked = new Value<SendBlock | null>(null)
  readonly sent: string[] = []
  sendData(text: string): boolean {
    return this.sent.push(text) > 0
  }
}

afterEach(cleanup)

function shown(entry = ENTRY): FakeStore {
  const store = new FakeStore()
  render(
    <WithRobot connection={new FakeConnection()}>
      <JsonSender robotId="r" entry={entry} store={store as unknown as AnyStore} />
    </WithRobot>,
  )
  return store
}

test('an observer is told that most robots take nothing of his', () => {
  const connection = new FakeConnection()
  connection.control.me.set({ peerId: 'me', name: 'Wanda', role: 'observer', isMe: true } as PeerView)
  render(
    <WithRobot connection={connection}>
      <JsonSender robotId="r" entry={ENTRY} store={new FakeStore() as unknown as AnyStore} />
    </WithRobot>,
  )
  expect(screen.getByRole('status').textContent).toContain('Your role is observer')
})

test('what is typed is sent', async () => {
  const store = shown()
  await userEvent.type(screen.getByLabelText('Message to arm'), 'home')
  await userEvent.click(screen.getByRole('button', { name: 'Send' }))
  expect(store.sent).toEqual(['home'])
})

const GRIPPER: CatalogueEntry = {
  ...ENTRY,
  dataType: 'json-u2r',
  messageSchema: { properties: { open: { type: 'boolean' }, width_m: { type: 'number', maximum: 0.1 } } },
}

test('a schema that is learned later makes the form', async () => {
  const store = new FakeStore()
  const page = (entry: CatalogueEntry) => (
    <WithRobot connection={new FakeConnection()}>
      <JsonSender robotId="r" entry={entry} store={store as unknown as AnyStore} />
    </WithRobot>
  )
  const { rerender } = render(page({ ...ENTRY, dataType: 'json-u2r' }))
  expect(screen.getByLabelText<HTMLTextAreaElement>('Message to arm').value).toBe('{}')
  rerender(page(GRIPPER))
  await userEvent.type(screen.getByLabelText('Width (m)'), '0.04')
  await userEvent.click(screen.getByLabelText('Open'))
  await userEvent.click(screen.getByRole('button', { name: 'Send' }))
  expect(store.sent).toEqual(['{"open":true,"width_m":0.04}'])
})

test('zeros that the page has made up are not sent as places to go to', async () => {
  const store = shown(GRIPPER)
  await userEvent.click(screen.getByRole('button', { name: 'Write it as JSON' }))
  const text = screen.getByLabelText<HTMLTextAreaElement>('Message to arm')
  expect(JSON.parse(text.value)).toEqual({ open: false, width_m: 0 })
  await userEvent.click(screen.getByRole('button', { name: 'Send' }))
  expect(screen.getByRole('status').textContent).toContain('numbers that nobody has said')
  expect(store.sent).toEqual([])
  await userEvent.type(text, ' ')
  await userEvent.click(screen.getByRole('button', { name: 'Send' }))
  expect(store.sent).toEqual(['{"open":false,"width_m":0}'])
})

test('what the robot would refuse is told beside its field, and not sent', async () => {
  const store = shown(GRIPPER)
  await userEvent.type(screen.getByLabelText('Width (m)'), '0.4')
  expect(screen.getByText('is at most 0.1 m')).toBeDefined()
  await userEvent.click(screen.getByRole('button', { name: 'Send' }))
  expect(screen.getByRole('status').textContent).toBe('Width is at most 0.1 m')
  expect(store.sent).toEqual([])
})

test('a form turns into JSON and back, with what was entered', async () => {
  shown(GRIPPER)
  await userEvent.type(screen.getByLabelText('Width (m)'), '0.04')
  await userEvent.click(screen.getByRole('button', { name: 'Write it as JSON' }))
  const field = screen.getByLabelText<HTMLTextAreaElement>('Message to arm')
  expect(JSON.parse(field.value)).toEqual({ open: false, width_m: 0.04 })
  await userEvent.clear(field)
  await userEvent.type(field, '{{"open": true, "width_m": 0.06}')
  await userEvent.click(screen.getByRole('button', { name: 'Fill in a form' }))
  expect(screen.getByLabelText<HTMLInputElement>('Width (m)').value).toBe('0.06')
  expect(screen.getByLabelText<HTMLInputElement>('Open').checked).toBe(true)
})

test('while somebody else commands nothing can be sent, and that is said', () => {
  const store = shown()
  act(() => store.sendBlocked.set({ code: 'lease.not_holder' }))
  expect(screen.getByRole('status').textContent).toContain('Somebody else commands')
  expect(screen.getByRole<HTMLButtonElement>('button', { name: 'Send' }).disabled).toBe(true)
})
