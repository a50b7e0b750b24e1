import type { CatalogueEntry, MessageInfo } from '@mosaic/client'
import type { AnyStore } from './storeKinds'
import { useConnectorStore } from './useConnectorStore'
import { useEveryJson } from './useReceived'

export interface EachMessageProps {
  robotId: string
  entry: CatalogueEntry
  onMessage: (message: unknown, info?: MessageInfo) => void
}

/** Hears another connector of the robot while it is mounted; draws nothing. */
export function EachMessage({ robotId, entry, onMessage }: EachMessageProps) {
  const store = useConnectorStore(robotId, entry.label, entry.dataType)
  return store === null ? null : <Listening store={store} onMessage={onMessage} />
}

function Listening({ store, onMessage }: { store: AnyStore; onMessage: EachMessageProps['onMessage'] }) {
  useEveryJson(store, onMessage)
  return null
}
