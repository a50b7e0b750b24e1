/** Where each connector stands on the robot's page: a picture leads, its control beside it, the rest follows. */
import type { CatalogueEntry } from '@mosaic/client'
import { chooseWidget, widgetsFor, type WidgetDefinition } from '@mosaic/widgets'
import { withPluginWidget } from '../plugins/withPluginWidget'
import type { ViewChoices } from './viewChoices'

export interface CardPlace {
  entry: CatalogueEntry
  widget: WidgetDefinition | null
  alternatives: readonly WidgetDefinition[]
  area: WidgetDefinition['area']
  columns: number
  rows: number
  /** Only the first picture and the first control stay in sight while a phone's page scrolls. */
  isLeading: boolean
}

const AREAS: readonly WidgetDefinition['area'][] = ['picture', 'control', 'panel']
const NO_WIDGET = { columns: 4, rows: 2 }
/** A second camera must not push everything else off the screen. */
const FURTHER_PICTURE = { columns: 4, rows: 5 }

export function placesOf(
  entries: readonly CatalogueEntry[],
  widgets: readonly WidgetDefinition[],
  choices: ViewChoices,
): CardPlace[] {
  const places = entries.map((entry): CardPlace => {
    const offered = withPluginWidget(widgets, entry)
    const widget = chooseWidget(offered, entry, choices[entry.label])
    const size = widget?.size ?? NO_WIDGET
    return { entry, widget, alternatives: widgetsFor(offered, entry), area: widget?.area ?? 'panel', ...size, isLeading: false }
  })
  const ordered = AREAS.flatMap((area) => places.filter((place) => place.area === area).map(leading))
  // Nobody shall drive by a picture that further ones pushed away from the control.
  return [...ordered.filter(({ isLeading }) => isLeading), ...ordered.filter(({ isLeading }) => !isLeading)]
}

function leading(place: CardPlace, index: number): CardPlace {
  if (place.area === 'panel') return place
  if (index === 0) return { ...place, isLeading: true }
  return place.area === 'picture' ? { ...place, ...FURTHER_PICTURE } : place
}
