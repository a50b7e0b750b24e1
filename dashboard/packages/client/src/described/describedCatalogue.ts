/**
 * The catalogue that a robot would announce if it could, from what people wrote down of its connectors. Pure; the same
 * as `mosaic_core.words.described`, held to it by one golden file.
 */
import {
  ORIGINAL_DRIVES,
  ORIGINAL_TYPES,
  type Catalogue,
  type CatalogueEntry,
  type ChannelEntry,
  type DescribedConnector,
  type Direction,
  type DriveCommand,
  type MosaicDataType,
  type OriginalType,
} from '@mosaic/protocol'

export const CONNECTION_CHECK = 'connection-check'
/** More channels for one point cloud no robot has; a slip of the keyboard must not open a thousand. */
const MOST_CHANNELS = 64
const PARALLEL_WORDS = ['parallelNum', 'parallel_num', 'parallel_stream']

/** What has no known data type is not in it. Of one label the first counts. */
export function describedCatalogue(connectors: readonly DescribedConnector[]): Catalogue | null {
  const entries = new Map<string, CatalogueEntry>()
  for (const connector of connectors) {
    const entry = describedEntry(connector)
    if (entry !== null && !entries.has(entry.label)) entries.set(entry.label, entry)
  }
  if (entries.size === 0) return null
  const all = [...entries.values()]
  return { hash: `described ${JSON.stringify(all)}`, entries: all }
}

/** Null where neither the table of types nor `dataType` tells what travels there. */
export function describedEntry(connector: DescribedConnector): CatalogueEntry | null {
  const { connectorId, connectorType } = connector
  const known = typeOf(connectorType)
  const whole = ORIGINAL_TYPES[CONNECTION_CHECK]
  const half = known?.half
  if (half !== undefined && whole && connectorId.endsWith(half) && connectorId !== half) {
    return entryOf(connectorId.slice(0, -half.length), connector, whole, whole.type)
  }
  const isUnknown = known === undefined && (connector.dataType ?? null) === null
  return isUnknown ? null : entryOf(connectorId, connector, known, connectorType)
}

/** How to command this connector of an original robot; null where it drives nothing that we know of. */
export function driveOf({ dataType, type, widget }: Pick<CatalogueEntry, 'dataType' | 'type' | 'widget'>): DriveCommand | null {
  if (dataType !== 'json-u2r') return null
  const name = typeOf(type)?.drive ?? (widget === 'drive-pad' ? 'twist' : undefined)
  return name === undefined ? null : (ORIGINAL_DRIVES[name] ?? null)
}

/** What the table says of a type; undefined where it does not know it. */
export function typeOf(connectorType: string | undefined): OriginalType | undefined {
  return Object.hasOwn(ORIGINAL_TYPES, connectorType ?? '') ? ORIGINAL_TYPES[connectorType ?? ''] : undefined
}

function entryOf(label: string, connector: DescribedConnector, known: OriginalType | undefined, type: string | undefined): CatalogueEntry {
  const isWhole = (known?.channels.length ?? 0) > 0
  const dataType = (isWhole ? known?.dataType : (connector.dataType ?? known?.dataType)) ?? 'json-bi'
  const widget = connector.widget ?? known?.widget
  return {
    label,
    type: type === undefined || type === '' ? dataType : type,
    kind: dataType === 'media' ? 'video' : 'data',
    dataType,
    direction: isWhole ? 'both' : directionOf(dataType),
    channels: channelsOf(label, dataType, connector, known),
    delivery: 'reliable',
    ...(widget === undefined ? {} : { widget }),
  }
}

function channelsOf(label: string, dataType: MosaicDataType, connector: DescribedConnector, known: OriginalType | undefined): readonly ChannelEntry[] {
  if (dataType === 'media') return []
  if (known !== undefined && known.channels.length > 0) return suffixed(label, known.channels)
  const count = parallelNumOf(connector) || (known?.parallelNum ?? 0)
  if (count === 0 || directionOf(dataType) !== 'to-operator') return [{ label, dataType }]
  return Array.from({ length: count }, (_, number) => ({ label: `${label}-${number}`, dataType }))
}

/** How many numbered channels it says it has; 0 where it does not say so. */
export function parallelNumOf({ params }: Pick<DescribedConnector, 'params'>): number {
  for (const word of PARALLEL_WORDS) {
    const value = params?.[word]
    const text = typeof value === 'number' || typeof value === 'string' ? String(value).trim() : ''
    if (/^\d+$/.test(text)) return Math.min(Number(text), MOST_CHANNELS)
  }
  return 0
}

function suffixed(label: string, channels: readonly ChannelEntry[]): readonly ChannelEntry[] {
  return channels.map((half) => ({ label: label + half.label, dataType: half.dataType }))
}

function directionOf(dataType: MosaicDataType): Direction {
  if (dataType.endsWith('-bi')) return 'both'
  return dataType.endsWith('-u2r') ? 'to-robot' : 'to-operator'
}
