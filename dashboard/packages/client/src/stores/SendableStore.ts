import { MosaicStore, type StoreType } from './MosaicStore'
import { sending } from './sending'

/** Sends to one connector of the robot. */
export class SendableStore extends sending(MosaicStore) {
  getStoreType(): StoreType {
    return 'sendable'
  }
}
