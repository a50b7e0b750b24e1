import { useMosaicClient, useReadable } from '@mosaic/react'
import { useEffect } from 'react'

/** How long a page waits where the browser doesn't tell when it is idle, as Safari. */
export const IDLE_MS = 1000

/**
 * Fetches what is used later once the page is idle, while the server is there: a person wants to know why a server is away when
 * nothing can be fetched any more. What fails here is fetched again, and told, when somebody needs it.
 */
export function useAhead(loads: readonly (() => Promise<unknown>)[]): void {
  const isServerHere = useReadable(useMosaicClient().server) === 'online'
  useEffect(() => {
    if (!isServerHere) return undefined
    return onceIdle(() => {
      for (const load of loads) load().catch(() => undefined)
    })
  }, [loads, isServerHere])
}

/** Returns what takes it back. */
function onceIdle(task: () => void): () => void {
  if (typeof globalThis.requestIdleCallback === 'function') {
    const request = requestIdleCallback(task)
    return () => cancelIdleCallback(request)
  }
  const timer = setTimeout(task, IDLE_MS)
  return () => clearTimeout(timer)
}
