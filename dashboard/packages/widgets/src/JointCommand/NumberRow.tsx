import { TextInput } from '@mantine/core'
import { useId, useState } from 'react'
import type { JointRange } from '../Joints/joints'
import { formatted } from '../schema/messageFields'
import { typedNumber } from './jointDraft'
import classes from './JointCommand.module.css'

export interface NumberRowProps extends JointRange {
  name: string
  unit: string
  /** As it was typed or set; null: it was not. */
  value: number | null
  /** Null: what stands there is no number within the range. */
  onChange: (value: number | null) => void
}

/** One number of a command that only a person can know. */
export function NumberRow({ name, unit, min, max, value, onChange }: NumberRowProps) {
  const id = useId()
  const [text, setText] = useState(() => value?.toString() ?? '')
  const read = (said: string) => {
    const number = typedNumber(said)
    return number === null || number < (min ?? number) || number > (max ?? number) ? null : number
  }
  // What was sent, taken back or set otherwise is shown; what is half typed stays.
  const shown = read(text) === value ? text : (value?.toString() ?? '')
  return (
    <div className={classes.slider} data-touched={value !== null}>
      <label htmlFor={id}>{name}</label>
      <TextInput
        id={id}
        size="xs"
        inputMode="decimal"
        placeholder={placeholderOf({ min, max }, unit)}
        value={shown}
        error={shown.trim() !== '' && value === null}
        onChange={({ currentTarget }) => {
          setText(currentTarget.value)
          onChange(read(currentTarget.value))
        }}
      />
      <span className={classes.value}>{value === null ? 'not set' : `${formatted(value)} ${unit}`}</span>
    </div>
  )
}

function placeholderOf({ min, max }: JointRange, unit: string): string {
  return min === null || max === null ? `where to, in ${unit}` : `${formatted(min)} to ${formatted(max)} ${unit}`
}
