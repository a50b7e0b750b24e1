import { Button, TextInput } from '@mantine/core'
import { useState } from 'react'
import { rangeOf } from '../Joints/joints'
import { useSender } from '../JsonSender/useSender'
import type { WidgetProps } from '../registry/WidgetDefinition'
import { typedNumber } from './jointDraft'
import classes from './JointCommand.module.css'
import { NumberRow } from './NumberRow'
import { SendRow } from './SendRow'
import { useKeptTarget } from './useKeptTarget'

/** Nobody tells how far it is: any gripper is open or shut by then. */
const LASTS_S = 3

/** How far a gripper shall open, and how hard it may press; sent at a press, under the lease. Nobody tells how far it is
 *  open, and a slider would begin at a made-up place: a number is typed, or an end of its range taken. */
export function GripperCommand({ entry, store }: WidgetProps) {
  const [position, setPosition] = useState<number | null>(null)
  const [effort, setEffort] = useState('')
  const sender = useSender(store)
  const kept = useKeptTarget<object>({ entry, store, message: (said) => said, isReached: () => false, lastsS: () => LASTS_S })
  const { min, max } = rangeOf(entry.safety, 'position')
  const shut = Math.max(0, min ?? 0)
  const effortN = typedNumber(effort, -Number.MIN_VALUE)
  const isWrong = effort.trim() !== '' && effortN === null
  return (
    <div className={classes.root}>
      <div className={classes.sliders} role="group" aria-label={`Target of ${entry.label}`}>
        <NumberRow name="Opening" unit="m" min={shut} max={max} value={position} onChange={setPosition} />
      </div>
      <SendRow
        sender={sender}
        isReady={position !== null && !isWrong}
        onHold={kept.target === null ? null : kept.end}
        onSend={() => {
          const target = effortN === null ? { position } : { position, max_effort: effortN }
          if (sender.send(JSON.stringify(target))) kept.keep(target)
        }}
      >
        <Button size="compact-md" variant="default" onClick={() => setPosition(shut)}>
          Shut
        </Button>
        {max !== null && (
          <Button size="compact-md" variant="default" onClick={() => setPosition(max)}>
            Open
          </Button>
        )}
        <TextInput
          className={classes.number}
          size="xs"
          inputMode="decimal"
          aria-label="Press at most (N)"
          placeholder="at most … N"
          value={effort}
          error={isWrong}
          onChange={(event) => setEffort(event.currentTarget.value)}
        />
      </SendRow>
    </div>
  )
}
