import type { StoreState } from '@mosaic/client'
import { useMosaicClient, useReadable } from '@mosaic/react'
import type { AnyStore } from './storeKinds'

const ROBOT_OFFLINE = 'signal.robot_offline'

/** The state of a store. That its robot is offline was the server's word: while that is away it alone is to blame. */
export function useStoreState(store: Pick<AnyStore, 'state'>): StoreState {
  const state = useReadable(store.state)
  const isServerAway = useReadable(useMosaicClient().server) !== 'online'
  return isServerAway && state.code === ROBOT_OFFLINE ? { phase: state.phase, code: 'signal.unreachable' } : state
}
