import type { SafetyLimit } from '@mosaic/client'
import { useReadable } from './useReadable'
import { useRobotConnection } from './useRobotConnection'

/** What is left of the speed of a connector that this page commands, and why; null: the robot limits nothing. */
export function useLimits(robotId: string, label: string): SafetyLimit | null {
  return useReadable(useRobotConnection(robotId).control.limits)[label] ?? null
}
