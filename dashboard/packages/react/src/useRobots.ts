import type { RobotSummary } from '@mosaic/client'
import { useMosaicClient } from './MosaicProvider'
import { useReadable } from './useReadable'

/** The robots of the account with their live status. */
export function useRobots(): readonly RobotSummary[] {
  return useReadable(useMosaicClient().robots)
}
