import { useMosaicClient, useReadable } from '@mosaic/react'
import { useEffect, useState } from 'react'

/** A blink of the line is nobody's concern. */
const SHOWN_AFTER_MS = 1500

/** Whether the server is away. Nobody knows then which robots are online: what the page knew of that is not said. */
export function useServerAway(): boolean {
  const isAway = useReadable(useMosaicClient().server) !== 'online'
  const [hasLasted, setHasLasted] = useState(false)
  useEffect(() => {
    if (!isAway) return undefined
    const timer = setTimeout(() => setHasLasted(true), SHOWN_AFTER_MS)
    return () => {
      clearTimeout(timer)
      setHasLasted(false)
    }
  }, [isAway])
  return isAway && hasLasted
}
