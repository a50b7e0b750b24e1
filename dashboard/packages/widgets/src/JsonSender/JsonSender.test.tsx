import { Value, type CatalogueEntry, type Refusal, type SendBlock, type StoreState } from '@mosaic/client'
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

function shown(): FakeStore {
  const store = new FakeStore()
  render(
    <WithRobot connection={new FakeConnection()}>
      <JsonSender robotId="r" entry={ENTRY} store={store as unknown as AnyStore} />
    </WithRobot>,
  )
  return store
}

test('what is typed is sent', async () => {
  const store = shown()
  await userEvent.type(screen.getByLabelText('Message to arm'), 'home')
  await userEvent.click(screen.getByRole('button', { name: 'Send' }))
  expect(store.sent).toEqual(['home'])
})

test('a schema that is learned later makes the template, until something is typed', async () => {
  const entry: CatalogueEntry = { ...ENTRY, dataType: 'json-u2r' }
  const store = new FakeStore()
  const page = (shownEntry: CatalogueEntry) => (
    <WithRobot connection={new FakeConnection()}>
      <JsonSender robotId="r" entry={shownEntry} store={store as unknown as AnyStore} />
    </WithRobot>
  )
  const { rerender } = render(page(entry))
  const field = screen.getByLabelText<HTMLTextAreaElement>('Message to arm')
  expect(field.value).toBe('{}')
  rerender(page({ ...entry, messageSchema: { properties: { open: { type: 'boolean' } } } }))
  expect(JSON.parse(field.value)).toEqual({ open: false })
  await userEvent.clear(field)
  await userEvent.type(field, '5')
  rerender(page(entry))
  expect(field.value).toBe('5')
})

test('while somebody else commands nothing can be sent, and that is said', () => {
  const store = shown()
  act(() => store.sendBlocked.set({ code: 'lease.not_holder' }))
  expect(screen.getByRole('status').textContent).toContain('Somebody else commands')
  expect(screen.getByRole<HTMLButtonElement>('button', { name: 'Send' }).disabled).toBe(true)
})
