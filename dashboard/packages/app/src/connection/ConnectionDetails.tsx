import { Button, Drawer, Group } from '@mantine/core'
import { timelineJson, type RobotConnection } from '@mosaic/client'
import { useReadable } from '@mosaic/react'
import { IconStethoscope } from '@tabler/icons-react'
import { Link } from 'react-router-dom'
import { CopyButton } from '../shell/CopyButton'
import { useServerAway } from '../shell/useServerAway'
import { bulkConnectionText, connectionText } from './connectionText'
import classes from './connection.module.css'
import { TimelineBars } from './TimelineBars'

export interface ConnectionDetailsProps {
  connection: RobotConnection
  /** Whether the robot is at the server; unknown while that isn't. */
  isOnline: boolean | undefined
  onClose: () => void
}

/** How the newest attempt went, phase by phase; for whoever wants to know, or has to report it. */
export default function ConnectionDetails({ connection, isOnline, onClose }: ConnectionDetailsProps) {
  const state = useReadable(connection.state)
  const timeline = useReadable(connection.timeline)
  const bulk = useReadable(connection.bulkLane)
  const { text, reason, cure } = connectionText(state, { isOnline, isServerAway: useServerAway() })
  return (
    // No veil over the page: somebody may be driving.
    <Drawer opened onClose={onClose} position="right" size="md" title="Connection details" withOverlay={false} lockScroll={false} trapFocus={false} classNames={{ inner: classes.inner }}>
      <div className={classes.root}>
        <p className={classes.facts}>
          <strong>{text}.</strong> {reason} {cure}
          {state.code !== undefined && <code className={classes.code}>{state.code}</code>}
        </p>
        {bulk.phase !== 'none' && (
          <p className={classes.facts} data-testid="bulk-connection">
            {bulkConnectionText(bulk)}
            {bulk.code !== undefined && <code className={classes.code}>{bulk.code}</code>}
          </p>
        )}
        {timeline === null ? <p className={classes.facts}>Nothing was tried yet.</p> : <TimelineBars timeline={timeline} />}
        <Group gap="sm">
          {timeline !== null && (
            <CopyButton size="compact-sm" text={timelineJson(timeline)}>
              Copy as JSON
            </CopyButton>
          )}
          <Button size="compact-sm" variant="default" leftSection={<IconStethoscope size={14} aria-hidden />} component={Link} to="/check">
            Check connection
          </Button>
        </Group>
      </div>
    </Drawer>
  )
}
