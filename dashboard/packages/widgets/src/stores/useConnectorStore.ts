/** A widget's hold on its store: taken while mounted, released after. */
import { useMosaicStore } from '@mosaic/react'
import type { MosaicDataType } from '@mosaic/client'
import { useEffect, useState } from 'react'
import type { AnyStore } from './storeKinds'

/** The store of a connector while the component is mounted; null on its first render. Given back when it is unmounted. */
export function useConnectorStore(robotId: string, connectorId: string, dataType: MosaicDataType): AnyStore | null {
  const stores = useMosaicStore()
  const [store, setStore] = useState<AnyStore | null>(null)
  useEffect(() => {
    const connector = { robotId, connectorId, dataType }
    // The store is an external resource that must be taken and given back in pairs, so it can't be made in render.
    // eslint-disable-next-line react-hooks/set-state-in-effect
    setStore(stores.getOrCreateStore(connector))
    return () => {
      stores.releaseStore(connector)
      setStore(null)
    }
  }, [robotId, connectorId, dataType, stores])
  return store
}
