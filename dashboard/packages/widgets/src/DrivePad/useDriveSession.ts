/** One `DriveSession` per mounted pad; it follows the store and ends with the pad. */
import { useReadable } from '@mosaic/react'
import { useEffect, useState } from 'react'
import type { AnyStore } from '../stores/storeKinds'
import { sends } from '../stores/storeKinds'
import type { DriveLimits } from './driveControl'
import type { MakeDriveClock } from './driveClock'
import { DriveSession } from './DriveSession'

export function useDriveSession(store: AnyStore, limits: DriveLimits, makeClock?: MakeDriveClock): DriveSession | null {
  const [session, setSession] = useState<DriveSession | null>(null)
  const isOpen = useReadable(store.state).phase === 'open'
  const { maxLinearMps, maxAngularRadps } = limits
  useEffect(() => {
    const made = new DriveSession({
      limits: { maxLinearMps, maxAngularRadps },
      send: (twist) => sends(store) && store.sendData(JSON.stringify(twist)),
      ...(makeClock === undefined ? {} : { makeClock }),
    })
    // The session owns a worker and listeners of the page: it is made and disposed in pairs, not in render.
    // eslint-disable-next-line react-hooks/set-state-in-effect
    setSession(made)
    return () => {
      made.dispose()
      setSession(null)
    }
  }, [store, maxLinearMps, maxAngularRadps, makeClock])
  useEffect(() => session?.setOpen(isOpen), [session, isOpen])
  return session
}
