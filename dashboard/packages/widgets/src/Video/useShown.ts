import { useEffect, type RefObject } from 'react'
import { isLeading } from '../frame/picturesInSight'
import type { ShowsMedia } from '../stores/storeKinds'

/** Tells the store at what size its picture is shown, and whether it leads, so that the robot sends bits where they are seen. */
export function useShown(robotId: string, store: ShowsMedia, root: RefObject<Element | null>): void {
  useEffect(() => {
    const element = root.current
    if (element === null || typeof ResizeObserver === 'undefined') return undefined
    const tell = () => {
      const { width, height } = element.getBoundingClientRect()
      const sizePx = width * height * window.devicePixelRatio ** 2
      store.setShown({ sizePx, leads: isLeading(robotId, element) })
    }
    const observer = new ResizeObserver(tell)
    observer.observe(element)
    return () => observer.disconnect()
  }, [robotId, store, root])
}
