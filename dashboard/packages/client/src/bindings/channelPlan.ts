/** Which channels a store needs, and whether the robot has its connector at all. Pure. */
import type { Catalogue, CatalogueEntry, ChannelEntry, Delivery, MosaicDataType } from '@mosaic/protocol'
import { entryFor } from '../words/entryFor'
import { nearestName } from '../words/nearestName'
import type { RobotConnector, StoreState } from '../words/types'

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

/** What decides beside the connector. */
export interface PlanSituation {
  /** What the robot told, or people say of it. */
  catalogue: Catalogue | null
  /** It is an original one: channels carry bare payloads. */
  isOriginal: boolean
  /** The channels that the store wants of itself; none where it wants a picture. */
  bare: readonly ChannelEntry[]
}

/**
 * With a catalogue that decides; without one an original robot is taken at the store's word: `bare` are the channels
 * that it wants, none where it wants a picture.
 */
export function channelPlan(connector: RobotConnector, { catalogue, isOriginal, bare }: PlanSituation): ChannelPlan {
  const { connectorId, dataType } = connector
  const isMedia = bare.length === 0
  if (isOriginal) return originalPlan(connector, catalogue, bare)
  if (catalogue === null) return isMedia ? { type: 'media' } : { type: 'unknown' }
  const entry = entryFor(catalogue, connectorId)
  if (entry === null) return { type: 'mismatch', state: missing(connectorId, catalogue) }
  const wanted = dataType ?? wantedBy(bare)
  if (wanted !== undefined && !isCompatible(wanted, entry.dataType)) {
    return { type: 'mismatch', state: otherWay(connectorId, wanted, entry) }
  }
  const lacking = lackingChannel(entry, bare)
  if (lacking !== undefined) return { type: 'mismatch', state: withoutChannel(entry, lacking.label) }
  if (entry.dataType === 'media') return { type: 'media' }
  const own = bare.length > 1 ? bare : [{ label: connectorId, dataType: entry.dataType }]
  const channels = entry.channels.length > 0 ? entry.channels : own
  return { type: 'channels', channels, delivery: entry.delivery, mayWait: mayWait(entry) }
}

/** An original robot announces nothing: what people described of it counts where the store can take that. */
function originalPlan({ connectorId, dataType }: RobotConnector, catalogue: Catalogue | null, bare: readonly ChannelEntry[]): ChannelPlan {
  if (bare.length === 0) return { type: 'media' }
  const entry = catalogue?.entries.find(({ label }) => label === connectorId)
  const isTold = entry !== undefined && entry.dataType !== 'media' && entry.channels.length > 0
  const isFit = isTold && isCompatible(dataType ?? wantedBy(bare) ?? entry.dataType, entry.dataType) && lackingChannel(entry, bare) === undefined
  return { type: 'channels', channels: isFit ? entry.channels : bare, delivery: 'reliable' }
}

/** What the class of the store says; one that can do both ways takes what comes. */
function wantedBy(bare: readonly ChannelEntry[]): MosaicDataType | undefined {
  const [first, ...more] = bare
  if (first === undefined) return 'media'
  return more.length === 0 && !first.dataType.endsWith('-bi') ? first.dataType : undefined
}

/** A class of several channels serves connectors that have them; a catalogue may leave out those of a known type. */
function lackingChannel({ type, channels }: CatalogueEntry, bare: readonly ChannelEntry[]): ChannelEntry | undefined {
  const isTold = bare.length > 1 && (channels.length > 0 || type !== 'connection-check')
  return isTold ? bare.find(({ label }) => !channels.some((channel) => channel.label === label)) : undefined
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

function withoutChannel({ label, type }: CatalogueEntry, lacking: string): StoreState {
  return { phase: 'mismatch', code: 'channel.unknown_label', message: `'${label}' is a ${type} and has no channel '${lacking}'` }
}

// JSON, strings and bytes are all bytes to a store; the way they flow is not to be argued about.
function isCompatible(wanted: MosaicDataType, offered: MosaicDataType): boolean {
  if (wanted === 'media' || offered === 'media') return wanted === offered
  return directionOf(offered) === 'bi' || directionOf(wanted) === directionOf(offered)
}

function directionOf(dataType: MosaicDataType): string {
  return dataType.slice(dataType.lastIndexOf('-') + 1)
}
