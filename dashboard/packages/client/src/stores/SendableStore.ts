import { MosaicStore, type StoreType } from './MosaicStore'
import { sending } from './sending'

/** Sends messages to a connector. */
export class SendableStore extends sending(MosaicStore) {
  getStoreType(): StoreType {
    return 'sendable'
  }
}
