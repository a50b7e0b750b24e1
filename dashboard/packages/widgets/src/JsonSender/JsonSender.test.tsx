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

test('while somebody else commands nothing can be sent, and that is said', () => {
  const store = shown()
  act(() => store.sendBlocked.set({ code: 'lease.not_holder' }))
  expect(screen.getByRole('status').textContent).toContain('Somebody else commands')
  expect(screen.getByRole<HTMLButtonElement>('button', { name: 'Send' }).disabled).toBe(true)
})
