import type { RobotConnection } from '@mosaic/client'
import { useMosaicClient } from './MosaicProvider'

/** The page's connection to this robot; the same object as long as the client lives. */
export function useRobotConnection(robotId: string): RobotConnection {
  return useMosaicClient().connection(robotId)
}
