import type { StoreType } from './MosaicStore'
import { ReceivableStore } from './ReceivableStore'
import { sending } from './sending'

/** Sends and receives on one connector. */
export class BidirectionalStore extends sending(ReceivableStore) {
  override getStoreType(): StoreType {
    return 'bidirectional'
  }
}
