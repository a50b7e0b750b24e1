import { useRef, useState } from 'react'
import { Notice } from '../frame/Notice'
import type { WidgetProps } from '../registry/WidgetDefinition'
import { useEveryJson } from '../stores/useReceived'
import classes from './Imu.module.css'
import { degreesText, imuOf, type ImuReading } from './imuText'

/** Degrees of pitch that fill half of the horizon's disc. */
const PITCH_SPAN_DEG = 45

/** Attitude as a horizon, with the rates and accelerations beside it. Drawn with every message, past React. */
export function Imu({ store }: WidgetProps) {
  const ground = useRef<SVGGElement>(null)
  const numbers = useRef<HTMLDListElement>(null)
  const [hasValue, setHasValue] = useState(false)
  useEveryJson(store, (message) => {
    const reading = imuOf(message)
    if (reading === null) return
    setHasValue(true)
    show(reading, ground.current, numbers.current)
  })
  return (
    <div className={classes.root}>
      <Horizon ground={ground} />
      <dl ref={numbers} className={classes.numbers}>
        <dt>Roll</dt>
        <dd data-cell="roll" />
        <dt>Pitch</dt>
        <dd data-cell="pitch" />
        <dt>Yaw</dt>
        <dd data-cell="yaw" />
        <dt>rad/s</dt>
        <dd data-cell="rate" />
        <dt>m/s²</dt>
        <dd data-cell="acceleration" />
      </dl>
      {!hasValue && <Notice tone="wait" title="No value yet" />}
    </div>
  )
}

function show({ attitude, angularVelocity, acceleration }: ImuReading, ground: Element | null, numbers: Element | null): void {
  const write = (name: string, text: string) => {
    const element = numbers?.querySelector(`[data-cell=${name}]`)
    if (element != null) element.textContent = text
  }
  write('roll', attitude === null ? '–' : degreesText(attitude.rollRad))
  write('pitch', attitude === null ? '–' : degreesText(attitude.pitchRad))
  write('yaw', attitude === null ? '–' : degreesText(attitude.yawRad))
  write('rate', angularVelocity)
  write('acceleration', acceleration)
  if (attitude === null || ground === null) return
  // REP-103: positive roll leans right, positive pitch looks down; the horizon moves the other way.
  const degrees = 180 / Math.PI
  const shift = Math.max(-50, Math.min(50, (-attitude.pitchRad * degrees * 50) / PITCH_SPAN_DEG))
  ground.setAttribute('transform', `rotate(${-attitude.rollRad * degrees} 50 50) translate(0 ${shift})`)
}

function Horizon({ ground }: { ground: React.RefObject<SVGGElement | null> }) {
  return (
    <svg className={classes.horizon} viewBox="0 0 100 100" role="img" aria-label="Artificial horizon">
      <defs>
        <clipPath id="mosaic-horizon-disc">
          <circle cx="50" cy="50" r="48" />
        </clipPath>
      </defs>
      <g clipPath="url(#mosaic-horizon-disc)">
        <rect width="100" height="100" fill="var(--m-accent-soft)" />
        <g ref={ground}>
          <rect x="-100" y="50" width="300" height="200" fill="var(--m-line-strong)" />
          <line x1="-100" x2="200" y1="50" y2="50" stroke="var(--m-text)" strokeWidth="1" />
          {[-30, -20, -10, 10, 20, 30].map((degrees) => (
            <line
              key={degrees}
              x1={50 - Math.abs(degrees) / 2.5}
              x2={50 + Math.abs(degrees) / 2.5}
              y1={50 + (degrees * 50) / PITCH_SPAN_DEG}
              y2={50 + (degrees * 50) / PITCH_SPAN_DEG}
              stroke="var(--m-muted)"
              strokeWidth="0.7"
            />
          ))}
        </g>
      </g>
      <path d="M22 50 H40 L50 56 L60 50 H78" fill="none" stroke="var(--m-accent)" strokeWidth="2.5" strokeLinejoin="round" />
      <circle cx="50" cy="50" r="48" fill="none" stroke="var(--m-line-strong)" strokeWidth="1.5" />
    </svg>
  )
}
