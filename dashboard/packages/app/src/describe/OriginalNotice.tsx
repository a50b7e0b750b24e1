import { useControl } from '@mosaic/react'
import { IconInfoCircle } from '@tabler/icons-react'
import classes from './describe.module.css'

/** What is different about a robot that knows none of ours, said where somebody is about to drive it. */
export function OriginalNotice({ robotId }: { robotId: string }) {
  const { availability } = useControl(robotId)
  if (availability !== 'unavailable') return null
  return (
    <p className={classes.original} role="note">
      <IconInfoCircle size={16} stroke={1.7} aria-hidden />
      <span>
        <strong>An original robot:</strong> one operator at a time (leave this page to let somebody else in), and no lease, limits
        or stop of its own.
      </span>
    </p>
  )
}
