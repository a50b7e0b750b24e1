import type { StopReport } from '@mosaic/client'
import { useStop } from '@mosaic/react'
import { useCallback } from 'react'
import { restAllPads } from './pads'

/** Stops the robot for everybody, and every pad of this page by itself: for robots that know no stop, its zeros are the stop. */
export function useStopRobot(robotId: string): (reason?: string) => Promise<StopReport> {
  const { stop } = useStop(robotId)
  return useCallback(
    (reason) => {
      // First the stop: it leaves before this returns.
      const report = stop(reason)
      restAllPads(robotId)
      return report
    },
    [stop, robotId],
  )
}
