import { nowMs, type Gap } from '@mosaic/client'
import { useReadable } from '@mosaic/react'
import { useEffect, useState } from 'react'
import type { AnyStore } from '../stores/storeKinds'

/** Long enough to be read, short enough not to stand in the way. */
const SHOWN_MS = 10_000

/** The last loss of messages while it is news; null afterwards. */
export function useRecentGap(store: AnyStore): Gap | null {
  const gap = useReadable(store.gap)
  const [over, setOver] = useState<Gap | null>(null)
  const leftMs = gap === null ? 0 : gap.atMs + SHOWN_MS - nowMs()
  useEffect(() => {
    if (gap === null) return
    const timer = setTimeout(() => setOver(gap), Math.max(0, leftMs))
    return () => clearTimeout(timer)
    // The time that is left counts from when the gap became known.
    // eslint-disable-next-line react-hooks/exhaustive-deps
  }, [gap])
  return gap === null || gap === over ? null : gap
}
