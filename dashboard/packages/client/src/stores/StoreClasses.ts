/** Which class of store serves a connector: what was registered, or else what the data type or the catalogue says. */
import type { CatalogueEntry, MosaicDataType } from '@mosaic/protocol'
import { BidirectionalStore } from './BidirectionalStore'
import { ConnectionCheckingStore } from './ConnectionCheckingStore'
import { MediaStreamStore } from './MediaStreamStore'
import type { MosaicStore } from './MosaicStore'
import { ReceivableStore } from './ReceivableStore'
import { SendableStore } from './SendableStore'
import { TalkStore } from './TalkStore'
import type { RobotConnector } from '../words/types'

/** A class whose stores need nothing but their connector. */
export type StoreClass<S extends MosaicStore = MosaicStore> = new (robotConnector: RobotConnector) => S

/** For which connectors a class is registered: by label, by the type in the robot's YAML file, or by data type. */
export type StoreMatch = { label: string } | { type: string } | { dataType: MosaicDataType }

type Key = 'label' | 'type' | 'dataType'

/** The narrowest first. */
const KEYS: readonly Key[] = ['label', 'type', 'dataType']

/** Chooses a store's class: those that a page registered, before those that come with the library. */
export class StoreClasses {
  private readonly registered: Record<Key, Map<string, StoreClass>> = { label: new Map(), type: new Map(), dataType: new Map() }

  register(Store: StoreClass, match: StoreMatch): void {
    for (const [key, wanted] of Object.entries(match) as [Key, string][]) this.registered[key].set(wanted, Store)
  }

  /**
   * `entry`: what the robot's catalogue says of the label; null while unknown. `Wanted`: the class that was asked for,
   * which a registered one may refine.
   */
  classOf(connector: RobotConnector, entry: CatalogueEntry | null, Wanted?: StoreClass): StoreClass {
    const dataType = connector.dataType ?? entry?.dataType
    const found = { label: connector.connectorId, type: entry?.type, dataType }
    const registered = KEYS.map((key) => this.registered[key].get(found[key] ?? '')).find((Store) => Store !== undefined)
    const isFit = registered !== undefined && (Wanted === undefined || registered.prototype instanceof Wanted)
    return isFit ? registered : (Wanted ?? ownClass(dataType, entry))
  }
}

function ownClass(dataType: MosaicDataType | undefined, entry: CatalogueEntry | null): StoreClass {
  if (entry?.type === 'connection-check') return ConnectionCheckingStore
  if (dataType === 'media') return entry?.kind === 'audio' && entry.direction === 'to-robot' ? TalkStore : MediaStreamStore
  if (dataType?.endsWith('r2u')) return ReceivableStore
  if (dataType?.endsWith('u2r')) return SendableStore
  // Neither the caller nor the robot said: what can do both serves both.
  return BidirectionalStore
}
