import type { Availability, ControlDesk, ControlEvent, LeaseView, PeerView } from '@mosaic/client'
import { useEffect, useEffectEvent } from 'react'
import { useReadable } from './useReadable'
import { useRobotConnection } from './useRobotConnection'

/** Who is connected to a robot, and who commands what. */
export interface Control {
  desk: ControlDesk
  /** `unavailable`: an original robot, which knows neither leases nor the stop. */
  availability: Availability
  me: PeerView | null
  peers: readonly PeerView[]
  /** By resource. */
  leases: Readonly<Record<string, LeaseView>>
}

/** Who is connected to the robot, and who commands what. */
export function useControl(robotId: string): Control {
  const { control: desk } = useRobotConnection(robotId)
  return {
    desk,
    availability: useReadable(desk.availability),
    me: useReadable(desk.me),
    peers: useReadable(desk.peers),
    leases: useReadable(desk.leases),
  }
}

/** `listener` hears of what happens once: granted, denied, lost, somebody asks, stopped, cleared, a right to stop changed. */
export function useControlEvents(robotId: string, listener: (event: ControlEvent) => void): void {
  const { control: desk } = useRobotConnection(robotId)
  const tell = useEffectEvent(listener)
  useEffect(() => desk.events.subscribe((event) => tell(event)), [desk])
}
