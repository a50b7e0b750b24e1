/** Makes the widget that a plugin ships one of those that the page chooses from. */
import type { CatalogueEntry } from '@mosaic/client'
import { chooseWidget, type WidgetDefinition } from '@mosaic/widgets'
import { IconPuzzle } from '@tabler/icons-react'
import { PluginWidget } from './PluginWidget'
import { sourceOf } from './servedModule'
import { wantedWidget } from './wantedWidget'

const PLACE = { area: 'panel', size: { columns: 4, rows: 4 } } as const

/** `widgets`, and before them the one that the connector's plugin ships, if it ships one. */
export function withPluginWidget(widgets: readonly WidgetDefinition[], entry: CatalogueEntry): readonly WidgetDefinition[] {
  const wanted = wantedWidget(entry)
  if (wanted === null || entry.widget === undefined) return widgets
  // It takes the place of the stock widget, which stands there where it can't be had.
  const { area, size } = chooseWidget(widgets, entry) ?? PLACE
  const own: WidgetDefinition = {
    id: entry.widget,
    title: `${wanted.exportName} (${sourceOf(wanted.module)})`,
    icon: IconPuzzle,
    accepts: { dataTypes: [entry.dataType], priority: 100 },
    area,
    size,
    Component: PluginWidget,
  }
  return [own, ...widgets]
}
