import type { RobotConnection } from '@mosaic/client'
import { useEffect } from 'react'

/** Connected while the page is open; tries again at once when the robot comes back. */
export function useConnected(connection: RobotConnection, isOnline: boolean | undefined): void {
  useEffect(() => {
    connection.connect()
    return () => connection.disconnect()
  }, [connection])
  useEffect(() => {
    if (isOnline === true) connection.connect()
  }, [connection, isOnline])
}
