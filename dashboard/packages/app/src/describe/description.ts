/** What people say that a robot has, and how a further word changes it. Pure. */
import { describedEntry, typeOf, type CatalogueEntry, type DescribedConnector, type MosaicDataType } from '@mosaic/client'
import { chooseWidget, fitOf, widgets } from '@mosaic/widgets'

export const DATA_TYPE_TITLES: Readonly<Record<MosaicDataType, string>> = {
  'json-r2u': 'JSON from the robot',
  'json-u2r': 'JSON to the robot',
  'json-bi': 'JSON both ways',
  'string-r2u': 'Text from the robot',
  'string-u2r': 'Text to the robot',
  'byte-r2u': 'Bytes from the robot',
  'byte-u2r': 'Bytes to the robot',
  media: 'Video from the robot',
}

/** What travels there, for people. */
export function travelText(entry: CatalogueEntry | null): string {
  if (entry === null) return 'what travels there is not known'
  const known = typeOf(entry.type)
  return known !== undefined && known.channels.length > 0 ? known.title : DATA_TYPE_TITLES[entry.dataType]
}

/** The label under which its card stands; both halves of a check of the connection have the same. */
export function labelOf(connector: DescribedConnector): string {
  return describedEntry(connector)?.label ?? connector.connectorId
}

/** `added` after what was there; of the same label the new word counts. */
export function withConnectors(before: readonly DescribedConnector[], added: readonly DescribedConnector[]): DescribedConnector[] {
  const labels = new Set(added.map(labelOf))
  return [...before.filter((one) => !labels.has(labelOf(one))), ...added]
}

export function withoutLabel(before: readonly DescribedConnector[], label: string): DescribedConnector[] {
  return before.filter((one) => labelOf(one) !== label)
}

/** One row per card: the halves of a check are one. */
export function describedRows(connectors: readonly DescribedConnector[]): { label: string; connector: DescribedConnector; entry: CatalogueEntry | null }[] {
  const rows = new Map(connectors.map((connector) => [labelOf(connector), connector]))
  return [...rows].map(([label, connector]) => ({ label, connector, entry: describedEntry(connector) }))
}

/** What travels there by the words of its type, where nobody knows the type: upstream's names say who sends. */
export function dataTypeByWords(type: string): MosaicDataType {
  if (/camera|image|video|webcam/i.test(type)) return 'media'
  if (/receiver|teleop|cmd|command/i.test(type)) return 'json-u2r'
  return /cloud|byte/i.test(type) ? 'byte-r2u' : 'json-r2u'
}

/** A connector of a type that may be unknown, with the data type and the widget that its name suggests. */
export function suggested(connectorId: string, connectorType: string, params?: Record<string, unknown>): DescribedConnector {
  const plain: DescribedConnector = { connectorId, connectorType, ...(params === undefined ? {} : { params }) }
  if (typeOf(connectorType) !== undefined) return plain
  const guessed = { ...plain, dataType: dataTypeByWords(connectorType) }
  const entry = describedEntry(guessed)
  const widget = entry === null ? null : chooseWidget(widgets, entry)
  return entry !== null && widget !== null && fitOf(widget, entry) === 'type' ? { ...guessed, widget: widget.id } : guessed
}

/** The widget that shows such a value best; undefined where nothing special fits. */
export function widgetOfValue(dataType: MosaicDataType, value: unknown): string | undefined {
  const entry = describedEntry({ connectorId: 'x', connectorType: '', dataType })
  if (entry === null) return undefined
  const told = { ...entry, [dataType === 'json-bi' ? 'sentSchema' : 'messageSchema']: schemaOf(value) }
  const shown = chooseWidget(widgets, told)
  return shown !== null && fitOf(shown, told) === 'schema' ? shown.id : undefined
}

/** As much of a JSON Schema as a single value tells. */
function schemaOf(value: unknown): Record<string, unknown> {
  if (Array.isArray(value)) return { type: 'array' }
  if (typeof value !== 'object' || value === null) return { type: value === null ? 'number' : typeof value }
  return { type: 'object', properties: Object.fromEntries(Object.entries(value).map(([key, inner]) => [key, schemaOf(inner)])) }
}
