// @vitest-environment happy-dom
/** The widget of the page about widgets that commands: it shows what the robot tells, sends on a click, and says why not. */
import { reasonOf, type CatalogueEntry } from '@mosaic/client'
import type { WidgetProps } from '@mosaic/widgets'
import { act, cleanup, fireEvent, render, screen } from '@testing-library/react'
import { createElement, type ComponentType } from 'react'
import { afterEach, beforeEach, expect, test } from 'vitest'
import { FakeConnection, WithRobot } from '../packages/widgets/test/fakeRobot'
import { FakeStore, storesOf } from '../packages/widgets/test/fakeStore'
import { exportsOf, listingOf } from './pageModules'

const STATE: CatalogueEntry = { label: 'grip', type: 'acme-grip', connector: 'grip', kind: 'data', dataType: 'json-r2u', direction: 'to-operator', channels: [], delivery: 'reliable' }
const COMMAND: CatalogueEntry = { ...STATE, label: 'grip_command', dataType: 'json-u2r', direction: 'to-robot' }
const { GripPanel } = exportsOf(listingOf('own-widget.md', 'acme_arm/widgets/acme-grip.js')) as { GripPanel: ComponentType<WidgetProps> }

let states: FakeStore
let commands: FakeStore
beforeEach(() => {
  states = new FakeStore()
  commands = new FakeStore()
  const connection = new FakeConnection()
  connection.catalogue.set({ hash: '', entries: [STATE, COMMAND] })
  const panel = createElement(GripPanel, { robotId: 'r', entry: STATE, store: states.asStore })
  render(createElement(WithRobot, { connection, client: storesOf({ grip_command: commands }), children: panel }))
})
afterEach(cleanup)

test('a click sends the opposite of what is shown', async () => {
  states.say({ is_closed: false })
  expect(screen.getByText('open')).toBeTruthy()
  fireEvent.click(screen.getByRole('button', { name: 'Close' }))
  states.say({ is_closed: true })
  fireEvent.click(await screen.findByRole('button', { name: 'Open' }))
  expect(commands.sent).toEqual([{ is_closed: true }, { is_closed: false }])
})

test('without the lease the button is off and says why', () => {
  act(() => commands.sendBlocked.set({ code: 'lease.required' }))
  expect(screen.getByRole<HTMLButtonElement>('button', { name: 'Close' }).disabled).toBe(true)
  expect(screen.getByRole('status').textContent).toBe(reasonOf('lease.required').sentence)
})
