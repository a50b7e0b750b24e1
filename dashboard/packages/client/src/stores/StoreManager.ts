import type { CatalogueEntry, MosaicDataType } from '@mosaic/protocol'
import { nowMs } from '../timing/clock'
import { DeadlineTimer } from '../timing/DeadlineTimer'
import { LingerCount } from './lingerCount'
import { StoreClasses, type StoreClass, type StoreMatch } from './StoreClasses'
import { BidirectionalStore } from './BidirectionalStore'
import type { MosaicStore } from './MosaicStore'
import { ReceivableStore } from './ReceivableStore'
import { SendableStore } from './SendableStore'
import type { RobotConnector } from '../words/types'

/** How long an unused store keeps its channel. */
export const LINGER_MS = 1000

/** The robot's side of the manager: who gives stores their channels. */
export interface StoreHost {
  /** What the robot's catalogue says of this label; null while unknown. */
  entryOf(label: string): CatalogueEntry | null
  addStore(store: MosaicStore): void
  removeStore(store: MosaicStore): void
}

/** Makes one store per connector and counts its users; an unused store lingers for a second. */
export class StoreManager {
  private readonly stores = new Map<string, MosaicStore>()
  private readonly classes = new StoreClasses()
  private readonly counts = new LingerCount<string>(LINGER_MS)
  private readonly timer: DeadlineTimer

  constructor(
    private readonly hostOf: (robotId: string) => StoreHost,
    private readonly now: () => number = nowMs,
  ) {
    this.timer = new DeadlineTimer({ now }, () => this.sweep())
  }

  /**
   * From now on connectors that `match` get stores of this class: by label, by the type that the robot announces, or by
   * data type. A label counts more than a type, that more than a data type; of two alike the newer counts. Without
   * `match` the class says its data type itself, as `static readonly dataType`.
   */
  registerMosaicStore(Store: StoreClass & { readonly dataType: MosaicDataType }): void
  registerMosaicStore(Store: StoreClass, match: StoreMatch): void
  registerMosaicStore(Store: StoreClass & { readonly dataType?: MosaicDataType }, match?: StoreMatch): void {
    const { dataType } = Store
    if (match !== undefined) this.classes.register(Store, match)
    else if (dataType !== undefined) this.classes.register(Store, { dataType })
    else throw new TypeError(`${Store.name} has no 'static dataType': say for which connectors it is, as in { label: 'battery' }`)
  }

  /**
   * The store of this connector; every call counts and asks for one `releaseStore`. Its class is `Store`, or the one
   * registered for it, or else follows from `dataType` or the robot's catalogue. Throws where somebody uses a store of
   * another class on the same connector already.
   */
  getOrCreateStore(connector: RobotConnector): MosaicStore
  getOrCreateStore<S extends MosaicStore>(connector: RobotConnector, Store: StoreClass<S>): S
  getOrCreateStore(connector: RobotConnector, Store?: StoreClass): MosaicStore {
    const key = keyOf(connector)
    const host = this.hostOf(connector.robotId)
    const Chosen = this.classes.classOf(connector, host.entryOf(connector.connectorId), Store)
    this.dropUnfit(key, connector, Chosen)
    const existing = this.stores.get(key)
    const isFit = existing !== undefined && (Store === undefined || existing instanceof Store)
    if (existing !== undefined && Store !== undefined && !isFit) this.makeRoom(key, existing, Store)
    this.counts.retain(key)
    if (isFit) return existing
    const store = new Chosen(connector)
    this.stores.set(key, store)
    host.addStore(store)
    return store
  }

  /** The counterpart of `getOrCreateStore`. The last release closes the store's channels after a second. */
  releaseStore(connector: RobotConnector): void {
    if (this.counts.release(keyOf(connector), this.now())) this.timer.set(this.counts.nextExpiryMs())
  }

  private sweep(): void {
    for (const key of this.counts.expired(this.now())) {
      const store = this.stores.get(key)
      if (store) this.remove(key, store)
    }
    this.timer.set(this.counts.nextExpiryMs())
  }

  /** One that only lingers makes room; one that is used does not. */
  private makeRoom(key: string, existing: MosaicStore, Store: StoreClass): void {
    if (this.counts.isRetained(key)) throw otherClass(existing, Store)
    this.remove(key, existing)
  }

  /** One that only lingers and can't do what is wanted now: its connector was described anew. */
  private dropUnfit(key: string, connector: RobotConnector, Chosen: StoreClass): void {
    const existing = this.stores.get(key)
    if (existing !== undefined && !this.counts.isRetained(key) && !canServe(existing, connector, Chosen)) this.remove(key, existing)
  }

  private remove(key: string, store: MosaicStore): void {
    this.stores.delete(key)
    this.hostOf(store.robotConnector.robotId).removeStore(store)
  }
}

function keyOf(connector: RobotConnector): string {
  return JSON.stringify([connector.robotId, connector.connectorId])
}

/** A store for both ways serves one: an original robot would not heed its label a second time. */
function canServe(store: MosaicStore, { dataType }: RobotConnector, Chosen: StoreClass): boolean {
  // What is sent there are bytes, which a port for JSON would send as text.
  if (dataType === 'byte-u2r' && store.robotConnector.dataType !== dataType) return false
  const isBoth = store.constructor === BidirectionalStore
  return store instanceof Chosen || (isBoth && (Chosen === ReceivableStore || Chosen === SendableStore))
}

function otherClass(existing: MosaicStore, Store: StoreClass): TypeError {
  const label = existing.robotConnector.connectorId
  return new TypeError(
    `'${label}' has a ${existing.constructor.name} already, and ${Store.name} was asked for: ` +
      `register it before the first use, with registerMosaicStore(${Store.name}, { label: '${label}' })`,
  )
}
