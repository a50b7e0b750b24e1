import { useReadable } from '@mosaic/react'
import { useEffect } from 'react'
import type { ShowsMedia } from '../stores/storeKinds'
import type { PictureState } from '../pictures/frameMeter'
import type { KeptPicture } from '../pictures/KeptPicture'

/**
 * The last picture of before, as long as there is no other: while the connection is made anew, and until the first
 * picture after. Null for good once the robot was left.
 */
export function useKeptPicture(store: ShowsMedia, picture: KeptPicture, state: PictureState): HTMLCanvasElement | null {
  const kept = useReadable(picture.canvas)
  const { phase } = useReadable(store.state)
  const isOver = state !== 'none' || phase === 'closed' || phase === 'mismatch'
  useEffect(() => {
    if (isOver) picture.drop()
  }, [isOver, picture])
  return isOver ? null : kept
}
