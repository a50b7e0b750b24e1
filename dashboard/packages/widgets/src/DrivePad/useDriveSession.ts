/** One `DriveSession` per mounted pad; it follows the store, the lease and the stop, and ends with the pad. */
import { driveOf, resourceOf, type CatalogueEntry, type Ticks } from '@mosaic/client'
import { useControl, useReadable, useStop } from '@mosaic/react'
import { useEffect, useEffectEvent, useState } from 'react'
import { useStopRobot } from '../control/useStopRobot'
import { usePictureInSight } from '../frame/usePictureInSight'
import type { AnyStore } from '../stores/storeKinds'
import { sends } from '../stores/storeKinds'
import { commandOf } from './driveCommand'
import { ZERO_TWIST, type DriveLimits, type Twist } from './driveTwist'
import { drivePermit, type PermitView } from './drivePermit'
import { DriveSession } from './DriveSession'

export interface DriveSessionSurroundings {
  robotId: string
  entry: CatalogueEntry
  store: AnyStore
  limits: DriveLimits
  ticks?: Ticks | undefined
}

export function useDriveSession({ robotId, entry, store, limits, ticks }: DriveSessionSurroundings) {
  const [session, setSession] = useState<DriveSession | null>(null)
  const permit = useDrivePermit(robotId, entry)
  const isOpen = useReadable(store.state).phase === 'open'
  const { desk } = useControl(robotId)
  const stopRobot = useStopRobot(robotId)
  const takeLease = useEffectEvent(() => void desk.requestLease(resourceOf(entry) ?? undefined))
  const stopAsked = useEffectEvent(() => void stopRobot('stop button of the gamepad'))
  const { maxLinearMps, maxAngularRadps } = limits
  const drive = driveOf(entry)
  // Every robot that tells its connectors tells its limits with them.
  const stopsItself = entry.safety !== undefined
  const asCommand = useEffectEvent((twist: Twist) => JSON.stringify(commandOf(twist, drive, limits)))
  useEffect(() => desk.addRest(entry.label, drive?.zero ?? ZERO_TWIST), [desk, entry.label, drive])
  useEffect(() => {
    const made = new DriveSession({
      robotId,
      limits: { maxLinearMps, maxAngularRadps },
      send: (twist) => sends(store) && store.sendData(asCommand(twist)),
      stopsItself,
      takeLease: () => takeLease(),
      stopRobot: () => stopAsked(),
      ...(ticks === undefined ? {} : { ticks }),
    })
    // The session owns a clock and listeners of the page: it is made and disposed in pairs, not in render.
    // eslint-disable-next-line react-hooks/set-state-in-effect
    setSession(made)
    return () => {
      made.dispose()
      setSession(null)
    }
  }, [robotId, store, maxLinearMps, maxAngularRadps, ticks, stopsItself])
  // First the permit: an open channel alone must not drive.
  useEffect(() => session?.setPermit(permit.permit, permit.reason), [session, permit.permit, permit.reason])
  useEffect(() => session?.setOpen(isOpen), [session, isOpen])
  return { session, permit }
}

function useDrivePermit(robotId: string, entry: CatalogueEntry): PermitView {
  const { availability, me, leases } = useControl(robotId)
  const { isStopped, by } = useStop(robotId)
  const isPictureInSight = usePictureInSight(robotId)
  const resource = resourceOf(entry)
  const lease = resource === null ? null : (leases[resource] ?? null)
  return drivePermit({ availability, me, isStopped, stoppedBy: by, resource, lease, isPictureInSight })
}
