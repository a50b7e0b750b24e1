import { IconWifiOff } from '@tabler/icons-react'
import classes from './shell.module.css'
import { useServerAway } from './useServerAway'

/** Says that the server is away. Robots that are already connected go on working without it. */
export function ServerBanner() {
  if (!useServerAway()) return null
  return (
    <div className={classes.banner} role="status">
      <IconWifiOff size={16} aria-hidden />
      <span>
        <strong>No connection to the server;</strong> trying again. Start it with `mosaic server run`, or ask whoever runs it.
        Robots you are connected to are not affected.
      </span>
    </div>
  )
}
