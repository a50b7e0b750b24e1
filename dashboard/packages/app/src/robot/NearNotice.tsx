import { CloseButton } from '@mantine/core'
import type { RobotConnection } from '@mosaic/client'
import { useReadable } from '@mosaic/react'
import { IconHome } from '@tabler/icons-react'
import { useState } from 'react'
import classes from './robot.module.css'

/** Says once per robot and browser that the robot serves this page itself, to those on its network. */
export function NearNotice({ connection }: { connection: RobotConnection }) {
  const { robotId } = connection
  const [first] = useReadable(connection.near)
  const [isDismissed, setIsDismissed] = useState(() => wasDismissed(robotId))
  if (first === undefined || isDismissed) return null
  const dismiss = () => {
    remember(robotId)
    setIsDismissed(true)
  }
  return (
    <div className={classes.notice} data-tone="info" role="status">
      <IconHome size={18} aria-hidden />
      <span className={classes.noticeText}>
        You are on this robot’s network. It can be reached directly, also without the internet: open{' '}
        <a href={`${first}/robots/${robotId}`} target="_blank" rel="noreferrer">
          {first}
        </a>
      </span>
      <CloseButton size="sm" aria-label="Do not show this again" onClick={dismiss} />
    </div>
  )
}

const KEY = 'mosaic.nearDismissed.'

function wasDismissed(robotId: string): boolean {
  try {
    return globalThis.localStorage.getItem(KEY + robotId) !== null
  } catch {
    return false
  }
}

function remember(robotId: string): void {
  try {
    globalThis.localStorage.setItem(KEY + robotId, '1')
  } catch {
    // A browser that stores nothing shows it again next time.
  }
}
