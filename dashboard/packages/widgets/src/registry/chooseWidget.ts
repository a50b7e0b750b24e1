/** Which widget shows a connector: every widget says how well it fits, the best one wins. No list of types anywhere. */
import type { CatalogueEntry } from '@mosaic/client'
import { hasPaths, type JsonSchema } from '../schema/jsonSchema'
import { mayHaveNumbers } from '../schema/messageFields'
import type { WidgetDefinition } from './WidgetDefinition'

/** How well a widget fits, best last. `possible` is offered to people but never chosen by itself. */
export const FITS = ['possible', 'anything', 'schema', 'type', 'message', 'hint'] as const
/** One of `FITS`: why a widget shows a connector. */
export type Fit = (typeof FITS)[number]

/** How well this widget fits this connector; null: it can't show it. */
export function fitOf(widget: WidgetDefinition, entry: CatalogueEntry): Fit | null {
  const { accepts } = widget
  if (!accepts.dataTypes.includes(entry.dataType)) return null
  if (accepts.kinds !== undefined && !accepts.kinds.includes(entry.kind)) return null
  if (accepts.directions !== undefined && !accepts.directions.includes(entry.direction)) return null
  const { id, schema } = messageFor(widget, entry)
  if (accepts.numbers === true && !mayHaveNumbers(schema)) return null
  if (entry.widget !== undefined && [widget.id, ...(accepts.hints ?? [])].includes(entry.widget)) return 'hint'
  // Whoever only sees what it sends could not command it.
  if (isDescribedBothWays(entry)) return accepts.bothWays === true ? 'schema' : 'possible'
  if (id !== undefined && accepts.schemas?.includes(id) === true) return 'message'
  if (accepts.connectorTypes?.includes(entry.type) === true) return 'type'
  if (accepts.fields?.some((paths) => hasPaths(schema, paths)) === true) return 'schema'
  if (accepts.anything === true) return 'anything'
  // Without a schema nobody can say that it doesn't fit.
  return schema === undefined ? 'possible' : null
}

function isDescribedBothWays({ dataType, messageSchema, sentSchema }: CatalogueEntry): boolean {
  return dataType === 'json-bi' && messageSchema !== undefined && sentSchema !== undefined
}

/** Of a connector that goes both ways: what the robot sends, for a widget that shows it, else what operators send. */
function messageFor({ accepts }: WidgetDefinition, entry: CatalogueEntry): { id?: string; schema?: JsonSchema } {
  const isShown = entry.dataType === 'json-bi' && accepts.dataTypes.includes('json-r2u')
  const [id, schema] = isShown ? [entry.sentSchemaId, entry.sentSchema] : [entry.schemaId, entry.messageSchema]
  return { ...(id !== undefined && { id }), ...(schema !== undefined && { schema }) }
}

/** Widgets that can show the connector, best first. */
export function widgetsFor(widgets: readonly WidgetDefinition[], entry: CatalogueEntry): WidgetDefinition[] {
  return widgets
    .flatMap((widget) => {
      const fit = fitOf(widget, entry)
      return fit === null ? [] : [{ widget, score: FITS.indexOf(fit) * 1000 + widget.accepts.priority }]
    })
    .sort((one, other) => other.score - one.score)
    .map(({ widget }) => widget)
}

/** The widget that a person chose, else the best one that fits by itself, else null. */
export function chooseWidget(
  widgets: readonly WidgetDefinition[],
  entry: CatalogueEntry,
  chosenId?: string,
): WidgetDefinition | null {
  const fitting = widgetsFor(widgets, entry)
  const chosen = fitting.find((widget) => widget.id === chosenId)
  if (chosen !== undefined) return chosen
  return fitting.find((widget) => fitOf(widget, entry) !== 'possible') ?? null
}
