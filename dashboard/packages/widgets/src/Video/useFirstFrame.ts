import { FIRST_FRAME_TIMEOUT_MS, firstFrameCode } from '@mosaic/client'
import { useEffect, useState } from 'react'
import type { ShowsMedia } from '../stores/storeKinds'
import type { PictureState } from '../pictures/frameMeter'

/** Why a camera shows nothing although it is watched; null while it is too early to ask, and once a picture came. */
export function useFirstFrame(store: ShowsMedia, stream: MediaStream | null, state: PictureState): string | null {
  const [code, setCode] = useState<string | null>(null)
  const isAwaited = stream !== null && state === 'none'
  useEffect(() => {
    if (!isAwaited) return undefined
    let isCurrent = true
    const ask = async () => {
      const found = firstFrameCode(await store.received())
      if (isCurrent) setCode(found)
    }
    const timer = setInterval(() => void ask(), FIRST_FRAME_TIMEOUT_MS)
    return () => {
      isCurrent = false
      clearInterval(timer)
      setCode(null)
    }
  }, [store, stream, isAwaited])
  return isAwaited ? code : null
}
