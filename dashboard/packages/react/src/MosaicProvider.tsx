import type { MosaicClient } from '@mosaic/client'
import { createContext, useContext, type ReactNode } from 'react'

const MosaicContext = createContext<MosaicClient | null>(null)

/** What `MosaicProvider` takes. */
export interface MosaicProviderProps {
  client: MosaicClient
  children?: ReactNode
}

/** Gives the page's `MosaicClient` to every hook below it. */
export function MosaicProvider({ client, children }: MosaicProviderProps): ReactNode {
  return <MosaicContext value={client}>{children}</MosaicContext>
}

/** The page's client. */
export function useMosaicClient(): MosaicClient {
  const client = useContext(MosaicContext)
  if (client === null) throw new Error('no MosaicProvider above this component')
  return client
}
