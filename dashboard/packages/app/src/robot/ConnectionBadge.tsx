import type { RobotConnection } from '@mosaic/client'
import { useReadable } from '@mosaic/react'
import { connectionText, formattedRoundTrip } from './connectionText'
import classes from './robot.module.css'

/** State of the connection and its round trip; its width stays the same while numbers change. */
export function ConnectionBadge({ connection }: { connection: RobotConnection }) {
  const state = useReadable(connection.state)
  const { tone, text } = connectionText(state)
  return (
    <span className={classes.badge} data-tone={tone} data-testid="connection" data-phase={state.phase}>
      <span role="status" className={classes.phase}>
        {text}
      </span>
      {state.phase === 'connected' && (
        <span className={classes.roundTrip} aria-label="Round trip" data-testid="round-trip">
          {formattedRoundTrip(state.roundTripMs)}
        </span>
      )}
    </span>
  )
}
