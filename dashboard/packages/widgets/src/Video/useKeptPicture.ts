import { useReadable } from '@mosaic/react'
import { useEffect, useState, type RefObject } from 'react'
import type { ShowsMedia } from '../stores/storeKinds'
import type { PictureState } from './frameMeter'
import { KeptPicture } from './KeptPicture'

interface Shown {
  store: ShowsMedia
  video: RefObject<HTMLVideoElement | null>
  /** The one in the element. */
  stream: MediaStream | null
  state: PictureState
}

/**
 * The last picture of before, as long as there is no other: while the connection is made anew, and until the first
 * picture after. Null once the robot was left. To be called before what takes the stream out of the element.
 */
export function useKeptPicture({ store, video, stream, state }: Shown): HTMLCanvasElement | null {
  const [picture] = useState(() => new KeptPicture())
  const kept = useReadable(picture.canvas)
  const { phase } = useReadable(store.state)
  const isOver = state !== 'none' || phase === 'closed' || phase === 'mismatch'
  useEffect(() => {
    const element = video.current
    if (stream === null || element === null) return undefined
    // At once when the store loses it: right after, its connection is closed.
    const unsubscribe = store.mediaStream.subscribe(() => picture.keep(element))
    return () => {
      unsubscribe()
      if (store.mediaStream.get() === stream) picture.keep(element)
    }
  }, [store, video, stream, picture])
  useEffect(() => {
    if (isOver) picture.drop()
  }, [isOver, picture])
  return isOver ? null : kept
}
