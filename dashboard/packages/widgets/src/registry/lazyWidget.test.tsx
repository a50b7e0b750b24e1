import { MantineProvider } from '@mantine/core'
import type { CatalogueEntry } from '@mosaic/client'
import { cleanup, render, screen } from '@testing-library/react'
import userEvent from '@testing-library/user-event'
import { useState, type ComponentType } from 'react'
import { afterEach, expect, test, vi } from 'vitest'
import { WidgetBoundary } from '../frame/WidgetBoundary'
import type { AnyStore } from '../stores/storeKinds'
import { lazyDialog } from './lazyDialog'
import { lazyWidget } from './lazyWidget'
import type { WidgetProps } from './WidgetDefinition'

afterEach(() => {
  cleanup()
  vi.restoreAllMocks()
})

function Percent() {
  return <p>81 %</p>
}

function show(Widget: ComponentType<WidgetProps>) {
  render(
    <MantineProvider env="test">
      <WidgetBoundary title="Battery">
        <Widget robotId="r" entry={{} as CatalogueEntry} store={{} as AnyStore} />
      </WidgetBoundary>
    </MantineProvider>,
  )
}

test('a widget is fetched when it is first shown', async () => {
  const load = vi.fn(() => Promise.resolve(Percent))
  const Widget = lazyWidget(load)
  expect(load).not.toHaveBeenCalled()
  show(Widget)
  expect(await screen.findByText('81 %')).toBeDefined()
})

test('one that cannot be fetched says so in its own card, and is fetched again', async () => {
  vi.spyOn(console, 'error').mockImplementation(() => undefined) // React tells it there too
  const load = vi.fn(() => Promise.resolve(Percent)).mockRejectedValueOnce(new TypeError('Failed to fetch'))
  show(lazyWidget(load))
  expect((await screen.findByRole('status')).textContent).toContain('Battery failed')
  await userEvent.click(screen.getByRole('button', { name: 'Try again' }))
  expect(await screen.findByText('81 %')).toBeDefined()
})

function Journal({ onClose }: { onClose: () => void }) {
  return <button onClick={onClose}>Close the journal</button>
}

test('a dialog that cannot be fetched says so, leaves the page as it is, and is fetched again when it is opened anew', async () => {
  vi.spyOn(console, 'error').mockImplementation(() => undefined)
  const load = vi.fn(() => Promise.resolve({ default: Journal })).mockRejectedValueOnce(new TypeError('Failed to fetch'))
  const LazyJournal = lazyDialog(load)
  function Page() {
    const [isOpen, setIsOpen] = useState(false)
    return (
      <>
        <button onClick={() => setIsOpen(true)}>Journal</button>
        {isOpen && <LazyJournal onClose={() => setIsOpen(false)} />}
      </>
    )
  }
  render(
    <MantineProvider env="test">
      <Page />
    </MantineProvider>,
  )
  await userEvent.click(screen.getByText('Journal'))
  expect((await screen.findByRole('alert')).textContent).toContain('the server may be away')
  await userEvent.click(screen.getByRole('button', { name: 'Hide this' }))
  expect(screen.queryByRole('alert')).toBeNull()
  await userEvent.click(screen.getByText('Journal'))
  await userEvent.click(await screen.findByText('Close the journal'))
  expect(screen.queryByText('Close the journal')).toBeNull()
})
