import type { Readable } from '@mosaic/client'
import { useSyncExternalStore } from 'react'

/** The value of a `Readable`; the component renders again when it changes. */
export function useReadable<T>(readable: Readable<T>): T {
  return useSyncExternalStore(readable.subscribe, readable.get, readable.get)
}
