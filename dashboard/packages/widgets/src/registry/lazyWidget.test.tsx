import { MantineProvider } from '@mantine/core'
import type { CatalogueEntry } from '@mosaic/client'
import { cleanup, render, screen } from '@testing-library/react'
import userEvent from '@testing-library/user-event'
import type { ComponentType } from 'react'
import { afterEach, expect, test, vi } from 'vitest'
import { WidgetBoundary } from '../frame/WidgetBoundary'
import type { AnyStore } from '../stores/storeKinds'
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
