import type { LeaseView } from '@mosaic/client'
import { useMemo } from 'react'
import { useReadable } from './useReadable'
import { useRobotConnection } from './useRobotConnection'

/** The lease of one resource of a robot, and what may be done about it. */
export interface Lease extends LeaseView {
  /** Ask to command; false: not connected, or the robot knows no leases. `force`: supervisors only, with a reason. */
  readonly take: (options?: { reason?: string; force?: boolean }) => boolean
  /** Give it back, or wait for it no longer. */
  readonly release: () => boolean
  /** As the holder: what I say to somebody who asked. */
  readonly answer: (peerId: string, grant: boolean, message?: string) => boolean
}

/** Who commands this resource of the robot, and the buttons for it. The three functions are stable. */
export function useLease(robotId: string, resource = 'motion'): Lease {
  const { control: desk } = useRobotConnection(robotId)
  const view = useReadable(desk.leases)[resource]
  const buttons = useMemo(
    () => ({
      take: (options?: { reason?: string; force?: boolean }) => desk.requestLease(resource, options),
      release: () => desk.releaseLease(resource),
      answer: (peerId: string, grant: boolean, message?: string) => desk.answerLease(resource, peerId, grant, message),
    }),
    [desk, resource],
  )
  return { ...(view ?? untold(resource)), ...buttons }
}

/** The robot has not said anything of it. */
function untold(resource: string): LeaseView {
  return { resource, state: 'free', holder: null, isMine: false, epoch: 0, queue: [], request: null, ended: null }
}
