import { Button } from '@mantine/core'
import type { RobotConnection, RobotSummary } from '@mosaic/client'
import { useMosaicClient, useReadable } from '@mosaic/react'
import { IconAlertTriangle } from '@tabler/icons-react'
import { Link } from 'react-router-dom'
import { TimelineBars } from '../connection/TimelineBars'
import { connectionText } from '../connection/connectionText'
import classes from './robot.module.css'

export interface ConnectionNoticeProps {
  connection: RobotConnection
  robot: RobotSummary | undefined
}

const START_ROBOT = 'Start it with `mosaic run`; this page connects by itself when it is back.'
const START_SERVER = 'The server does not answer: start it with `mosaic server run`, or ask whoever runs it.'

/** Why there is no connection, what to do about it, and a way to try again. */
export function ConnectionNotice({ connection, robot }: ConnectionNoticeProps) {
  const state = useReadable(connection.state)
  const timeline = useReadable(connection.failedTimeline)
  const { reason, cure, canRetry, text, tone } = connectionText(state)
  // Without the server nobody knows whether the robot is there.
  const isServerHere = useReadable(useMosaicClient().server) === 'online'
  const isOffline = robot?.isOnline === false
  if (tone === 'ok' || (reason === '' && !isOffline)) return null
  return (
    <div className={classes.notice} data-tone={tone} role="alert">
      <IconAlertTriangle size={18} aria-hidden />
      <span className={classes.noticeText}>
        <strong>{reason === '' ? `${robot?.name ?? 'The robot'} is offline.` : reason}</strong>{' '}
        {isServerHere ? (isOffline ? START_ROBOT : cure) : START_SERVER}
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
