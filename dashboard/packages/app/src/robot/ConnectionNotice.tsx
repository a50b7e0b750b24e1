import { Button } from '@mantine/core'
import type { RobotConnection, RobotSummary } from '@mosaic/client'
import { useReadable } from '@mosaic/react'
import { IconAlertTriangle } from '@tabler/icons-react'
import { Link } from 'react-router-dom'
import { TimelineBars } from '../connection/TimelineBars'
import { connectionText } from '../connection/connectionText'
import { useServerAway } from '../shell/useServerAway'
import classes from './robot.module.css'

export interface ConnectionNoticeProps {
  connection: RobotConnection
  robot: RobotSummary | undefined
}

const START_ROBOT = 'Start it with `mosaic run`; this page connects by itself when it is back.'

/** Why there is no connection, what to do about it, and a way to try again. That the server is away is said for every page. */
export function ConnectionNotice({ connection, robot }: ConnectionNoticeProps) {
  const state = useReadable(connection.state)
  const timeline = useReadable(connection.failedTimeline)
  const isServerAway = useServerAway()
  const { reason, cure, canRetry, text, tone } = connectionText(state, { isOnline: robot?.isOnline, isServerAway })
  const isOffline = robot?.isOnline === false
  if (isServerAway || tone === 'ok' || (reason === '' && !isOffline)) return null
  return (
    <div className={classes.notice} data-tone={tone} role="alert">
      <IconAlertTriangle size={18} aria-hidden />
      <span className={classes.noticeText}>
        <strong>{reason === '' ? `${robot?.name ?? 'The robot'} is offline.` : reason}</strong>{' '}
        {isOffline ? START_ROBOT : cure}
        {state.code !== undefined && <code className={classes.code}>{state.code}</code>}
        {timeline !== null && !isOffline && (
          <details className={classes.how}>
            <summary>How far it got</summary>
            <TimelineBars timeline={timeline} />
          </details>
        )}
      </span>
      <Button size="compact-sm" variant="subtle" component={Link} to="/check">
        Check connection
      </Button>
      {canRetry && (
        <Button size="compact-sm" variant="default" onClick={() => connection.connect()} aria-label={`${text}: try again`}>
          Try again
        </Button>
      )}
    </div>
  )
}
