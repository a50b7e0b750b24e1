import { nowMs } from '@mosaic/client'
import { useEffect, useState } from 'react'

/** How many seconds this page was hidden the last time; 0: it was not. */
export function useHiddenFor(): number {
  const [seconds, setSeconds] = useState(0)
  useEffect(() => {
    let sinceMs: number | null = null
    const changed = () => {
      if (document.visibilityState === 'hidden') sinceMs = nowMs()
      else if (sinceMs !== null) setSeconds(Math.max(1, Math.round((nowMs() - sinceMs) / 1000)))
    }
    document.addEventListener('visibilitychange', changed)
    return () => document.removeEventListener('visibilitychange', changed)
  }, [])
  return seconds
}
