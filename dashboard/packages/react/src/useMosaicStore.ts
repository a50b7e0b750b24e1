import type { RobotConnector, StoreManager } from '@mosaic/client'
import { useMemo } from 'react'
import { useMosaicClient } from './MosaicProvider'

/** What a component does with stores; the page's `StoreManager` explains both. */
export interface MosaicStoreAccess {
  readonly getOrCreateStore: StoreManager['getOrCreateStore']
  readonly releaseStore: (connector: RobotConnector) => void
}

/** Stores of connectors, counted: every `getOrCreateStore` asks for one `releaseStore`. Both are stable. */
export function useMosaicStore(): MosaicStoreAccess {
  const { storeManager } = useMosaicClient()
  return useMemo(
    () => ({
      getOrCreateStore: storeManager.getOrCreateStore.bind(storeManager),
      releaseStore: (connector) => storeManager.releaseStore(connector),
    }),
    [storeManager],
  )
}
