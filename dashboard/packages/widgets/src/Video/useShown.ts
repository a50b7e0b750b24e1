import { useEffect, type RefObject } from 'react'
import { isLeading, pictureRect, watchSight } from '../frame/picturesInSight'
import type { ShowsMedia } from '../stores/storeKinds'

/**
 * Tells the store at what size its picture is shown, and whether it leads, so that the robot sends bits where they are
 * seen. Which one leads changes with the others, whatever happens to this one's own size.
 */
export function useShown(robotId: string, store: ShowsMedia, root: RefObject<Element | null>): void {
  useEffect(
    () =>
      watchSight(() => {
        if (root.current === null) return
        const { width, height } = pictureRect(root.current)
        const sizePx = width * height * window.devicePixelRatio ** 2
        store.setShown({ sizePx, leads: isLeading(robotId, root.current) })
      }),
    [robotId, store, root],
  )
}
