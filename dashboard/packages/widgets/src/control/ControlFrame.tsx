import { useControl, useReadable, useStop } from '@mosaic/react'
import classes from './control.module.css'
import { limitText, type LimitText } from './controlText'

/** Less than this is said beside the pad alone: a frame that comes and goes around the page tires the eye. */
const FRAMED_BELOW = 0.9

/** A frame around the whole page, seen from the corner of an eye: red while stopped, amber while the robot slows down. */
export function ControlFrame({ robotId }: { robotId: string }) {
  const { isStopped } = useStop(robotId)
  const limit = useWorstLimit(robotId)
  const tone = isStopped ? 'stopped' : (limit?.tone ?? 'none')
  return (
    <div className={classes.frame} data-tone={tone} data-testid="control-frame">
      {!isStopped && limit !== null && (
        <span className={classes.frameText} role="status">
          <strong>{limit.title}</strong> {limit.why}
        </span>
      )}
    </div>
  )
}

/** Of everything that this page commands on the robot. */
function useWorstLimit(robotId: string): LimitText | null {
  const { desk } = useControl(robotId)
  const limits = Object.values(useReadable(desk.limits)).sort((one, other) => one.factor - other.factor)
  const worst = limits[0]
  return worst === undefined || worst.factor >= FRAMED_BELOW ? null : limitText(worst)
}
