/** Which channels a store needs, and whether the robot has its connector at all. Pure. */
import type { Catalogue, CatalogueEntry, ChannelEntry, Delivery, MosaicDataType } from '@mosaic/protocol'
import { nearestName } from './nearestName'
import type { RobotConnector, StoreState } from './types'

export type ChannelPlan =
  /** `mayWait`: what is sent there may wait for a connection, or be repeated on the next one. */
  | { type: 'channels'; channels: readonly ChannelEntry[]; delivery: Delivery; mayWait?: boolean }
  | { type: 'media' }
  /** Nobody knows yet: the robot has not told its connectors. */
  | { type: 'unknown' }
  | { type: 'mismatch'; state: StoreState }

/** A store made before anybody knew that its connector is a picture. */
export const NOT_MEDIA: StoreState = {
  phase: 'mismatch',
  code: 'channel.unknown_label',
  message: "this connector is a picture: give dataType 'media', or make the store once the catalogue is known",
}

/**
 * With a catalogue that decides; without one an original robot is taken at the store's word: `bare` are the channels
 * that it wants, none where it wants a picture.
 */
export function channelPlan(
  connector: RobotConnector,
  catalogue: Catalogue | null,
  isOriginal: boolean,
  bare: readonly ChannelEntry[],
): ChannelPlan {
  const { connectorId, dataType } = connector
  const isMedia = bare.length === 0
  if (isOriginal) return isMedia ? { type: 'media' } : { type: 'channels', channels: bare, delivery: 'reliable' }
  if (catalogue === null) return isMedia ? { type: 'media' } : { type: 'unknown' }
  const entry = catalogue.entries.find(({ label }) => label === connectorId)
  if (!entry) return { type: 'mismatch', state: missing(connectorId, catalogue) }
  if (dataType !== undefined && !isCompatible(dataType, entry.dataType)) {
    return { type: 'mismatch', state: otherWay(connectorId, dataType, entry) }
  }
  if (entry.dataType === 'media') return { type: 'media' }
  const own = [{ label: connectorId, dataType: entry.dataType }]
  const channels = entry.channels.length > 0 ? entry.channels : own
  return { type: 'channels', channels, delivery: entry.delivery, mayWait: mayWait(entry) }
}

function mayWait({ delivery, safety }: CatalogueEntry): boolean {
  const isFree = !safety || !['requires_lease', 'timeout_s', 'max_rate_hz'].some((key) => Boolean(safety[key]))
  return delivery === 'reliable' && isFree
}

function missing(label: string, catalogue: Catalogue): StoreState {
  const known = catalogue.entries.map((entry) => entry.label)
  const nearest = nearestName(label, known)
  const message = `the robot has no connector '${label}'` + (nearest === null ? '' : `; did you mean '${nearest}'?`)
  const state: StoreState = { phase: 'mismatch', code: 'channel.unknown_label', message }
  return nearest === null ? state : { ...state, nearest }
}

function otherWay(label: string, wanted: MosaicDataType, entry: CatalogueEntry): StoreState {
  const message = `'${label}' is ${entry.dataType} on the robot, ${wanted} was asked for`
  return { phase: 'mismatch', code: 'channel.unknown_label', message }
}

// JSON, strings and bytes are all bytes to a store; the way they flow is not to be argued about.
function isCompatible(wanted: MosaicDataType, offered: MosaicDataType): boolean {
  if (wanted === 'media' || offered === 'media') return wanted === offered
  return directionOf(offered) === 'bi' || directionOf(wanted) === directionOf(offered)
}

function directionOf(dataType: MosaicDataType): string {
  return dataType.slice(dataType.lastIndexOf('-') + 1)
}
