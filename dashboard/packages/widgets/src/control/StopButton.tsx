import { Tooltip, VisuallyHidden } from '@mantine/core'
import { useControl, useReadable, useStop } from '@mosaic/react'
import { IconHandStop } from '@tabler/icons-react'
import type { PointerEvent } from 'react'
import classes from './control.module.css'
import { NOT_CERTIFIED, stopHint, stopTakenText } from './controlText'
import { STOP_KEY_TEXT } from './stopKey'
import { useStopKey } from './useStopKey'
import { useStopRobot } from './useStopRobot'

export interface StopButtonProps {
  robotId: string
  /** False for a second button on the same page: one press of the stop key is one stop. */
  hasKey?: boolean
}

/**
 * Stops the robot, for everybody, at once: at the touch, not at its end. Anybody who is connected may, but an observer
 * from whom a supervisor took that right.
 */
export function StopButton({ robotId, hasKey = true }: StopButtonProps) {
  const { availability, desk, me } = useControl(robotId)
  const restable = useReadable(desk.restable)
  const { isStopped, mine } = useStop(robotId)
  const stopRobot = useStopRobot(robotId)
  const taken = stopTakenText(me)
  const stop = () => void (taken === '' && stopRobot())
  useStopKey(stop, hasKey)
  const hasNone = taken !== '' || (availability === 'unavailable' && restable.length === 0)
  const state = mine?.phase === 'sending' ? 'stopping' : isStopped ? 'stopped' : hasNone ? 'none' : 'ready'
  const what = taken === '' ? stopHint(availability, restable) : taken
  return (
    <Tooltip multiline w={260} label={<StopHint what={what} hasNone={hasNone} />} openDelay={300}>
      <button
        type="button"
        className={classes.stop}
        data-state={state}
        data-testid="stop"
        aria-disabled={taken !== ''}
        aria-description={hasNone || availability === 'unavailable' ? what : undefined}
        aria-keyshortcuts="Escape Escape"
        onPointerDown={(event) => isPrimary(event) && stop()}
        // A keyboard or a screen reader: no pointer came before.
        onClick={(event) => event.detail === 0 && stop()}
        onContextMenu={(event) => event.preventDefault()}
      >
        <IconHandStop size={22} stroke={2} aria-hidden />
        <span className={classes.stopWord}>{WORDS[state]}</span>
        <VisuallyHidden>{state === 'ready' ? ' the robot' : '; stop the robot'}</VisuallyHidden>
        <kbd className={classes.stopKey} aria-hidden>
          {STOP_KEY_TEXT}
        </kbd>
      </button>
    </Tooltip>
  )
}

const WORDS = { ready: 'Stop', stopping: 'Stopping…', stopped: 'Stopped', none: 'No stop' }

function StopHint({ what, hasNone }: { what: string; hasNone: boolean }) {
  if (hasNone) return <span>{what}</span>
  return (
    <span>
      <strong>Stop</strong>: press Escape twice, or hold it. {what} {NOT_CERTIFIED}
    </span>
  )
}

function isPrimary(event: PointerEvent): boolean {
  return event.button === 0
}
