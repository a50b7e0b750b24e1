import { useId } from 'react'
import { formatted } from '../schema/messageFields'
import classes from './JointCommand.module.css'

export interface SliderRowProps {
  name: string
  unit: string
  min: number
  max: number
  /** Where it was set, else where it is reported; where neither is known there must be no slider. */
  value: number
  isTouched: boolean
  onChange: (value: number) => void
}

/** One number of a command, within its range: by hand, by the arrow keys, or typed. */
export function SliderRow({ name, unit, min, max, value, isTouched, onChange }: SliderRowProps) {
  const id = useId()
  const step = stepOf(max - min)
  const text = `${formatted(value)} ${unit}`
  return (
    <div className={classes.slider} data-touched={isTouched}>
      <label htmlFor={id}>{name}</label>
      <input
        id={id}
        type="range"
        min={min}
        max={max}
        step={step}
        value={value}
        aria-valuetext={text}
        onChange={(event) => onChange(event.currentTarget.valueAsNumber)}
      />
      <span className={classes.value} aria-hidden>
        {text}
      </span>
    </div>
  )
}

/** Fine enough for a hand, in round numbers. */
function stepOf(span: number): number {
  return span <= 0 ? 0.001 : 10 ** Math.floor(Math.log10(span / 200))
}
