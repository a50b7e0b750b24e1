/** The widget that a robot's catalogue names and a plugin ships. */
import type { CatalogueEntry, WidgetModule } from '@mosaic/client'

export interface WantedWidget {
  module: WidgetModule
  exportName: string
}

const EXPORT_NAME = /^[A-Za-z_$][\w$]*$/

/** What `acme-arm/ArmPanel` names, where the robot announces that very module; null for a stock widget. */
export function wantedWidget({ widget, widgetModule }: CatalogueEntry): WantedWidget | null {
  if (widget === undefined || widgetModule === undefined) return null
  const exportName = widget.slice(widgetModule.name.length + 1)
  const isOne = widget === `${widgetModule.name}/${exportName}` && EXPORT_NAME.test(exportName)
  return isOne ? { module: widgetModule, exportName } : null
}
