import { TextInput } from '@mantine/core'
import { useState } from 'react'
import { rangeOf } from '../Joints/joints'
import { useSender } from '../JsonSender/useSender'
import type { WidgetProps } from '../registry/WidgetDefinition'
import { typedNumber } from './jointDraft'
import classes from './JointCommand.module.css'
import { SendRow } from './SendRow'
import { SliderRow } from './SliderRow'

/** As far as a gripper of a hand's size opens, where nothing is said. */
const OPEN_M = 0.1

/** How far a gripper shall open, and how hard it may press; sent at a press, under the lease. */
export function GripperCommand({ entry, store }: WidgetProps) {
  const [position, setPosition] = useState<number | null>(null)
  const [effort, setEffort] = useState('')
  const sender = useSender(store)
  const { min, max } = rangeOf(entry.safety, 'position')
  const effortN = typedNumber(effort, -Number.MIN_VALUE)
  const isWrong = effort.trim() !== '' && effortN === null
  return (
    <div className={classes.root}>
      <div className={classes.sliders} role="group" aria-label={`Target of ${entry.label}`}>
        <SliderRow
          name="Opening"
          unit="m"
          min={Math.max(0, min ?? 0)}
          max={max ?? OPEN_M}
          value={position}
          isTouched={position !== null}
          onChange={setPosition}
        />
      </div>
      <SendRow
        sender={sender}
        isReady={position !== null && !isWrong}
        onSend={() => sender.send(JSON.stringify(effortN === null ? { position } : { position, max_effort: effortN }))}
      >
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
