import { DeliveryWatch, StoreCounters, Value, type Catalogue, type CatalogueEntry } from '@mosaic/client'
import { act, cleanup, render, screen } from '@testing-library/react'
import userEvent from '@testing-library/user-event'
import { afterEach, expect, test } from 'vitest'
import { FakeConnection, WithRobot } from '../test/fakeRobot'
import { FakeStore, storesOf } from '../test/fakeStore'
import { ConnectorCard } from './ConnectorCard'

afterEach(cleanup)

const entry = (label: string): CatalogueEntry => ({
  label,
  type: 'battery',
  kind: 'data',
  dataType: 'json-r2u',
  direction: 'to-operator',
  channels: [],
  delivery: 'reliable',
})

function card(catalogue: Catalogue | null) {
  const connection = new FakeConnection()
  connection.catalogue.set(catalogue)
  const store = Object.assign(new FakeStore(), { counters: new StoreCounters(), gap: new Value(null) })
  const client = storesOf({ battery: store })
  Object.assign(connection, { delivery: new DeliveryWatch(() => true) })
  render(
    <WithRobot connection={connection} client={client}>
      <ConnectorCard robotId="a" label="battery" />
    </WithRobot>,
  )
  return connection
}

test('a card waits for what the robot has, and says what it has not', () => {
  const connection = card(null)
  expect(screen.getByRole('region', { name: 'battery' }).getAttribute('aria-busy')).toBe('true')
  act(() => connection.catalogue.set({ hash: 'h', entries: [entry('batery')] }))
  expect(screen.getByText("The robot has no connector 'battery'")).toBeDefined()
  expect(screen.getByText(/Did you mean 'batery'/)).toBeDefined()
  act(() => connection.catalogue.set({ hash: 'i', entries: [] }))
  expect(screen.getByText(/Compare the label/)).toBeDefined()
})

test('a card shows the widget that fits, and another one that a person chooses', async () => {
  card({ hash: 'h', entries: [entry('battery')] })
  const user = userEvent.setup()
  await user.click(await screen.findByRole('button', { name: 'Menu of battery' }))
  await user.click(await screen.findByRole('menuitem', { name: 'Raw JSON' }))
  expect(screen.getByRole('region', { name: 'battery: Raw JSON' })).toBeDefined()
})
