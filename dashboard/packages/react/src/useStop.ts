import type { ClearReport, StopReport, StopView } from '@mosaic/client'
import { useMemo } from 'react'
import { useReadable } from './useReadable'
import { useRobotConnection } from './useRobotConnection'

/** Whether a robot is stopped, and what may be done about it. */
export interface StopControl extends StopView {
  /** Stop the robot; it stays stopped until cleared. Never rejects. No certified emergency stop. */
  readonly stop: (reason?: string) => Promise<StopReport>
  /** Let commands act again; never rejects. */
  readonly clear: () => Promise<ClearReport>
}

/** Whether the robot is stopped, how my last stop went, and the buttons for it. The two functions are stable. */
export function useStop(robotId: string): StopControl {
  const { control: desk } = useRobotConnection(robotId)
  const view = useReadable(desk.stopState)
  const buttons = useMemo(
    () => ({ stop: (reason?: string) => desk.stop(reason), clear: () => desk.clearStop() }),
    [desk],
  )
  return { ...view, ...buttons }
}
