import { useMosaicClient, useReadable } from '@mosaic/react'
import { IconWifiOff } from '@tabler/icons-react'
import { useEffect, useState } from 'react'
import classes from './shell.module.css'

/** A blink of the line is nobody's concern. */
const SHOWN_AFTER_MS = 1500

/** Says when the server can't be reached. Robots that are already connected go on working without it. */
export function ServerBanner() {
  const state = useReadable(useMosaicClient().server)
  const isShown = useLasting(state !== 'online', SHOWN_AFTER_MS)
  if (!isShown) return null
  return (
    <div className={classes.banner} role="status">
      <IconWifiOff size={16} aria-hidden />
      <span>
        <strong>No connection to the server;</strong> trying again. Robots you are connected to are not affected.
      </span>
    </div>
  )
}

/** True once `condition` has held for `periodMs`. */
function useLasting(condition: boolean, periodMs: number): boolean {
  const [hasLasted, setHasLasted] = useState(false)
  useEffect(() => {
    if (!condition) return undefined
    const timer = setTimeout(() => setHasLasted(true), periodMs)
    return () => {
      clearTimeout(timer)
      setHasLasted(false)
    }
  }, [condition, periodMs])
  return condition && hasLasted
}
