import { Loader } from '@mantine/core'
import { IconEar, IconEarOff } from '@tabler/icons-react'
import { useEffect, useEffectEvent } from 'react'
import { DATA_TYPE_TITLES } from './description'
import classes from './describe.module.css'
import { useTryOut, type TryOut } from './useTryOut'

const SAMPLE_CHARS = 160

export interface TryOutLineProps {
  robotId: string
  label: string
  /** Something was heard. */
  onTake: (found: TryOut) => void
}

/** What comes on a label while it is tried. */
export function TryOutLine({ robotId, label, onTake }: TryOutLineProps) {
  const found = useTryOut(robotId, label)
  const take = useEffectEvent(onTake)
  const dataType = found.guess?.dataType
  useEffect(() => {
    if (dataType !== undefined) take(found)
    // Told once per finding, not once per message.
    // eslint-disable-next-line react-hooks/exhaustive-deps
  }, [dataType, found.isNumbered])
  return (
    <div className={classes.tryOut} role="status" data-phase={found.phase}>
      {found.phase === 'waiting' ? <Loader size={16} /> : found.phase === 'heard' ? <IconEar size={18} aria-hidden /> : <IconEarOff size={18} aria-hidden />}
      <span>
        {textOf(found, label)}
        {found.guess?.value !== undefined && <code className={classes.sample}>{sampleOf(found.guess.value)}</code>}
      </span>
    </div>
  )
}

function textOf({ phase, guess, isNumbered }: TryOut, label: string): string {
  if (phase === 'waiting') return `Listening to ‘${label}’ …`
  if (guess === null) {
    return `Nothing came on ‘${label}’. Either the robot has no such label, or it only receives there (a drive says nothing): then say what it is.`
  }
  const numbered = isNumbered ? ` on the numbered channel ‘${label}-0’: say how many of them there are` : ''
  return `${DATA_TYPE_TITLES[guess.dataType]}${numbered}.`
}

function sampleOf(value: unknown): string {
  const text = JSON.stringify(value)
  return text.length > SAMPLE_CHARS ? `${text.slice(0, SAMPLE_CHARS)}…` : text
}
