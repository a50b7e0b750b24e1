import type { MosaicStore, RobotConnector } from '@mosaic/client'
import { useMemo } from 'react'
import { useMosaicClient } from './MosaicProvider'

export interface MosaicStoreAccess {
  readonly getOrCreateStore: (connector: RobotConnector) => MosaicStore
  readonly releaseStore: (connector: RobotConnector) => void
}

/** Stores of connectors, counted: every `getOrCreateStore` asks for one `releaseStore`. Both are stable. */
export function useMosaicStore(): MosaicStoreAccess {
  const { storeManager } = useMosaicClient()
  return useMemo(
    () => ({
      getOrCreateStore: (connector) => storeManager.getOrCreateStore(connector),
      releaseStore: (connector) => storeManager.releaseStore(connector),
    }),
    [storeManager],
  )
}
