import { useEffect, useSyncExternalStore, type RefObject } from 'react'
import { addPicture, isPictureInSight, watchSight } from './picturesInSight'

/** Whether the leading picture of the robot is on the screen, for as long as this is mounted. */
export function usePictureInSight(robotId: string): boolean {
  return useSyncExternalStore(watchSight, () => isPictureInSight(robotId))
}

/** The element shows a picture of the robot, where `isPicture`. */
export function useAsPicture(robotId: string, element: RefObject<Element | null>, isPicture: boolean): void {
  useEffect(() => {
    if (!isPicture || element.current === null) return undefined
    return addPicture(robotId, element.current)
  }, [robotId, element, isPicture])
}
