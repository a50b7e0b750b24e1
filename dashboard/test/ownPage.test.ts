// @vitest-environment happy-dom
/** What the page about pages of one's own shows of a label that the robot does not have. */
import { MediaStreamStore, ReceivableStore, type MosaicStore } from '@mosaic/client'
import { act, cleanup, render, screen } from '@testing-library/react'
import { createElement, type ComponentType } from 'react'
import { afterEach, expect, test } from 'vitest'
import { FakeConnection, WithRobot } from '../packages/widgets/test/fakeRobot'
import { exportsOf, listingOf } from './pageModules'

const WHY = "the robot has no connector 'frnt'; did you mean 'front'?"
const OWN = { './watchMismatch': exportsOf(listingOf('own-page.md', 'src/watchMismatch.ts')) }
const connector = { robotId: 'r', connectorId: 'frnt' }
afterEach(cleanup)

function shown(name: string, store: MosaicStore): void {
  const Component = exportsOf(listingOf('own-page.md', `src/${name}.tsx`), OWN)[name] as ComponentType<{ robotId: string; label: string }>
  const client = { storeManager: { getOrCreateStore: () => store, releaseStore: () => {} } }
  const children = createElement(Component, { robotId: 'r', label: 'frnt' })
  render(createElement(WithRobot, { connection: new FakeConnection(), client, children }))
}

test.each([
  ['Battery', new ReceivableStore(connector)],
  ['Picture', new MediaStreamStore(connector)],
])('a misspelt label of %s is told with the nearest one', (name, store) => {
  shown(name, store)
  expect(screen.queryByText(WHY, { exact: false })).toBeNull()
  act(() => store.setState({ phase: 'mismatch', code: 'channel.unknown_label', message: WHY, nearest: 'front' }))
  expect(screen.getByText(WHY, { exact: false })).toBeTruthy()
  act(() => store.setState({ phase: 'open' }))
  expect(screen.queryByText(WHY, { exact: false })).toBeNull()
})
