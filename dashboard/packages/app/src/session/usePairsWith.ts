import { useMosaicClient } from '@mosaic/react'
import { useEffect, useState } from 'react'

/** A server that does not say within this long gets the usual sign-in. */
const PATIENCE_MS = 1500

/** The robot that this server belongs to; null for a server of many, undefined until that is known. */
export function usePairsWith(): string | null | undefined {
  const client = useMosaicClient()
  const [robot, setRobot] = useState<string | null | undefined>(undefined)
  useEffect(() => {
    let isMounted = true
    const settle = (found: string | null) => isMounted && setRobot((known) => known ?? found)
    const timer = setTimeout(() => settle(null), PATIENCE_MS)
    client.api
      .server()
      .then((info) => settle(info.pairsWith ?? null))
      .catch(() => settle(null))
    return () => {
      isMounted = false
      clearTimeout(timer)
    }
  }, [client])
  return robot
}
