import type { RobotConnection } from '@mosaic/client'
import { useReadable } from '@mosaic/react'
import { lazyDialog } from '@mosaic/widgets'
import { useState } from 'react'
import { connectionText, formattedRoundTrip } from '../connection/connectionText'
import { useServerAway } from '../shell/useServerAway'
import classes from './robot.module.css'

const ConnectionDetails = lazyDialog(() => import('../connection/ConnectionDetails'))

/** State of the connection and its round trip, whose width stays the same while numbers change; a click tells more. */
export function ConnectionBadge({ connection, isOnline }: { connection: RobotConnection; isOnline: boolean | undefined }) {
  const state = useReadable(connection.state)
  const { tone, text } = connectionText(state, { isOnline, isServerAway: useServerAway() })
  const [isOpen, setIsOpen] = useState(false)
  return (
    <>
      <span className={classes.badge} data-tone={tone} data-testid="connection" data-phase={state.phase}>
        <span role="status" className={classes.phase}>
          {text}
        </span>
        {state.phase === 'connected' && (
          <span className={classes.roundTrip} aria-label="Round trip" data-testid="round-trip">
            {formattedRoundTrip(state.roundTripMs)}
          </span>
        )}
        <button type="button" className={classes.badgeButton} aria-label="Connection details" onClick={() => setIsOpen(true)} />
      </span>
      {isOpen && <ConnectionDetails connection={connection} isOnline={isOnline} onClose={() => setIsOpen(false)} />}
    </>
  )
}
