import { MantineProvider } from '@mantine/core'
import type { CatalogueEntry, MosaicClient, MosaicStore, WidgetModule, WidgetOffer } from '@mosaic/client'
import { MosaicProvider } from '@mosaic/react'
import { chooseWidget, widgets, widgetsFor } from '@mosaic/widgets'
import { cleanup, render, screen } from '@testing-library/react'
import userEvent from '@testing-library/user-event'
import { afterEach, expect, test, vi } from 'vitest'
import { PluginWidget } from './PluginWidget'
import { wantedWidget } from './wantedWidget'
import { withPluginWidget } from './withPluginWidget'

const MODULE: WidgetModule = { name: 'acme-arm', distribution: 'acme-arm', version: '1.2.0', sha256: 'a'.repeat(64), sizeBytes: 10 }
const ENTRY: CatalogueEntry = {
  label: 'arm',
  type: 'acme-arm',
  kind: 'data',
  dataType: 'json-r2u',
  direction: 'to-operator',
  channels: [],
  delivery: 'reliable',
  widget: 'acme-arm/ArmPanel',
  widgetModule: MODULE,
  messageSchema: { type: 'object', properties: { angle_rad: { type: 'number' } } },
}
const CAMERA: CatalogueEntry = { ...ENTRY, kind: 'video', dataType: 'media' }
const SPEECHLESS: CatalogueEntry = { ...ENTRY, dataType: 'byte-u2r' }

afterEach(cleanup)

test('the widget of the plugin is chosen where nobody chose otherwise, and a stock one can be', () => {
  const offered = withPluginWidget(widgets, ENTRY)
  const stock = chooseWidget(widgets, ENTRY)
  expect(chooseWidget(offered, ENTRY)).toMatchObject({ title: 'ArmPanel (acme-arm 1.2.0)', area: stock?.area, size: stock?.size })
  expect(chooseWidget(offered, ENTRY, stock?.id)).toBe(stock)
  expect(widgetsFor(offered, ENTRY).slice(1)).toEqual(widgetsFor(widgets, ENTRY))
})

test('it takes the place that the stock widget would have', () => {
  expect(chooseWidget(withPluginWidget(widgets, CAMERA), CAMERA)).toMatchObject({ id: 'acme-arm/ArmPanel', area: 'picture' })
  expect(chooseWidget(withPluginWidget(widgets, SPEECHLESS), SPEECHLESS)).toMatchObject({ id: 'acme-arm/ArmPanel', area: 'panel' })
})

test.each([
  [{ ...ENTRY, widget: 'raw-json' }],
  [{ ...ENTRY, widget: 'acme-leg/ArmPanel' }],
  [{ ...ENTRY, widget: 'acme-arm/' }],
  [{ ...ENTRY, widget: 'acme-arm/a/b' }],
  [{ ...ENTRY, widget: 'acme-arm.ArmPanel' }],
  [{ ...ENTRY, widgetModule: undefined }],
])('a connector whose hint is not that of its module has stock widgets alone', (entry) => {
  expect(wantedWidget(entry as CatalogueEntry)).toBeNull()
  expect(withPluginWidget(widgets, entry as CatalogueEntry)).toBe(widgets)
})

/** A store that never receives anything. */
const STORE = { subscribe: () => () => {}, latest: null } as unknown as MosaicStore

function show(offer: () => Promise<WidgetOffer>) {
  const client = { api: { widgets: offer } } as unknown as MosaicClient
  render(
    <MantineProvider env="test">
      <MosaicProvider client={client}>
        <PluginWidget robotId="r" entry={{ ...ENTRY, dataType: 'byte-u2r' }} store={STORE} />
      </MosaicProvider>
    </MantineProvider>,
  )
}

test('a module that can’t be had is named with its plugin and version, and asked for again', async () => {
  const offer = vi.fn(() => Promise.resolve<WidgetOffer>({ isOn: false, modules: [] }))
  show(offer)
  const why = await screen.findByRole('status')
  expect(why.textContent).toContain('ArmPanel of acme-arm 1.2.0 can’t be shown. Widgets of plugins are switched off on this server.')
  offer.mockResolvedValue({ isOn: true, modules: [] })
  await userEvent.click(screen.getByRole('button', { name: 'Try again' }))
  expect(await screen.findByText(/The server does not have this plugin/)).toBeDefined()
  expect(offer).toHaveBeenCalledTimes(2)
})
