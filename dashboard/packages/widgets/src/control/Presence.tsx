import { Button, Popover, VisuallyHidden } from '@mantine/core'
import { useControl } from '@mosaic/react'
import { IconEye, IconRobot, IconSteeringWheel, IconUser, IconUsers } from '@tabler/icons-react'
import { useMemo, useState } from 'react'
import classes from './control.module.css'
import { presenceSentence, presentOf, type Present } from './presence'
import { useEscape } from './useEscape'

/** More than this many names would push the rest of the header away; the list has them all. */
const CHIPS_MAX = 3

/** Who drives and who watches: chips where there is room for them, a list behind a number everywhere. */
export function Presence({ robotId }: { robotId: string }) {
  const { availability, peers, leases, me, desk } = useControl(robotId)
  const present = useMemo(() => presentOf(peers, leases), [peers, leases])
  const [isOpen, setIsOpen] = useState(false)
  useEscape(() => setIsOpen(false), isOpen)
  if (availability !== 'available' || present.length === 0) return null
  return (
    <Popover opened={isOpen} onChange={setIsOpen} position="bottom-end" shadow="lg" width={280}>
      <Popover.Target>
        <button type="button" className={classes.presence} data-testid="presence" onClick={() => setIsOpen(!isOpen)}>
          <VisuallyHidden>Who is here. {presenceSentence(present)}</VisuallyHidden>
          <span className={classes.chips} aria-hidden>
            {present.slice(0, CHIPS_MAX).map((one) => (
              <Chip key={one.peerId} one={one} />
            ))}
          </span>
          <span className={classes.presenceCount} data-more={present.length > CHIPS_MAX} aria-hidden>
            <IconUsers size={16} stroke={1.7} />
            {present.length}
          </span>
        </button>
      </Popover.Target>
      <Popover.Dropdown>
        <ul className={classes.presenceList}>
          {present.map((one) => (
            <li key={one.peerId}>
              <Icon one={one} />
              <span className={classes.presenceName}>{one.name}</span>
              <span className={classes.presenceRole}>
                {one.isPerson ? one.role : `program, ${one.role}`}
                {one.mayStop ? '' : `, may not stop: ${one.stopTakenBy} took that right`} · {one.drives.length === 0 ? 'watching' : `driving ${drivesText(one)}`}
              </span>
              {me?.role === 'supervisor' && one.role === 'observer' && (
                <Button size="compact-xs" variant="default" onClick={() => desk.changeStopRight(one.peerId, !one.mayStop)}>
                  {one.mayStop ? 'Take the right to stop' : 'Let stop again'}
                </Button>
              )}
            </li>
          ))}
        </ul>
      </Popover.Dropdown>
    </Popover>
  )
}

function Chip({ one }: { one: Present }) {
  return (
    <span className={classes.chip} data-drives={one.drives.length > 0}>
      <Icon one={one} />
      {one.name}
    </span>
  )
}

function Icon({ one }: { one: Present }) {
  const props = { size: 14, stroke: 1.8, 'aria-hidden': true } as const
  if (one.drives.length > 0) return <IconSteeringWheel {...props} />
  if (!one.isPerson) return <IconRobot {...props} />
  return one.isMe ? <IconUser {...props} /> : <IconEye {...props} />
}

function drivesText({ drives }: Present): string {
  return drives.filter((resource) => resource !== 'motion').join(', ')
}
