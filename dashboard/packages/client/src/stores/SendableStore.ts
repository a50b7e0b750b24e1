import { MosaicStore, type StoreType } from './MosaicStore'
import { sending } from './sending'

/** Operator → robot. */
export class SendableStore extends sending(MosaicStore) {
  getStoreType(): StoreType {
    return 'sendable'
  }
}
