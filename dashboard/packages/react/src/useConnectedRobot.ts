import type { RobotConnection } from '@mosaic/client'
import { useEffect } from 'react'
import { useRobotConnection } from './useRobotConnection'
import { useRobots } from './useRobots'

/**
 * The page's connection to this robot, up while the component is mounted: it tries again at once when the robot comes back.
 * One component of a page connects; those below it use `useRobotConnection`.
 */
export function useConnectedRobot(robotId: string): RobotConnection {
  const connection = useRobotConnection(robotId)
  const isOnline = useRobots().find(({ id }) => id === robotId)?.isOnline
  useEffect(() => {
    connection.connect()
    return () => connection.disconnect()
  }, [connection])
  useEffect(() => {
    if (isOnline === true) connection.connect()
  }, [connection, isOnline])
  return connection
}
