import { Notice } from '../frame/Notice'
import type { WidgetProps } from '../registry/WidgetDefinition'
import { jsonOf } from '../stores/decode'
import { useLatest } from '../stores/useReceived'
import { barOf, stickOf, type StickAxis, type StickButton } from './joystick'
import classes from './Joystick.module.css'

/** A bar for each axis of a stick, from its middle, and a mark for each button. */
export function Joystick({ entry, store }: WidgetProps) {
  const latest = useLatest(store)
  const decoded = latest === null ? null : jsonOf(latest.data)
  if (decoded === null) return <Notice tone="wait" title="No stick yet" />
  const stick = decoded.ok ? stickOf(decoded.value) : null
  if (stick === null) return <Notice tone="bad" title="Not the state of a stick">It has axes and buttons, which are numbers.</Notice>
  return (
    <div className={classes.scroll} tabIndex={0} role="region" aria-label={`Stick of ${entry.label}`}>
      {stick.axes.map((axis, index) => (
        <Axis key={index} axis={axis} />
      ))}
      <div className={classes.buttons} role="list" aria-label="Buttons">
        {stick.buttons.map((button, index) => (
          <Button key={index} button={button} />
        ))}
      </div>
    </div>
  )
}

function Axis({ axis: { name, value } }: { axis: StickAxis }) {
  const { start, length } = barOf(value)
  return (
    <div className={classes.axis}>
      <span className={classes.name}>{name}</span>
      <div className={classes.bar} role="meter" aria-label={name} aria-valuemin={-1} aria-valuemax={1} aria-valuenow={value}>
        <span className={classes.fill} style={{ insetInlineStart: `${start}%`, inlineSize: `${length}%` }} />
      </div>
      <span className={classes.value}>{value.toFixed(2)}</span>
    </div>
  )
}

function Button({ button: { name, isPressed } }: { button: StickButton }) {
  return (
    <span className={classes.button} role="listitem" data-pressed={isPressed} aria-label={isPressed ? `${name}, pressed` : name}>
      {name}
    </span>
  )
}
