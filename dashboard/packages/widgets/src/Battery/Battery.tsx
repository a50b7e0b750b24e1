import { Notice } from '../frame/Notice'
import type { WidgetProps } from '../registry/WidgetDefinition'
import { arrivingSchema } from '../schema/arrivingSchema'
import { fieldValues, formatted } from '../schema/messageFields'
import { jsonOf } from '../stores/decode'
import { useLatest } from '../stores/useReceived'
import classes from './Battery.module.css'
import { percentOf, toneOf } from './charge'

const LEVEL_FIELDS = ['percent', 'percentage', 'battery_percent']

/** How full the battery is, and what else it says. */
export function Battery({ entry, store }: WidgetProps) {
  const latest = useLatest(store, 500)
  if (latest === null) return <Notice tone="wait" title="No value yet" />
  const decoded = jsonOf(latest.data)
  const message = decoded.ok ? decoded.value : null
  const percent = percentOf(message)
  const rest = fieldValues(arrivingSchema(entry), message).filter(
    (field) => !LEVEL_FIELDS.includes(field.path.join('.')) && field.path.at(-1) !== 'timestamp',
  )
  return (
    <div className={classes.root}>
      <div className={classes.head}>
        <span className={classes.percent}>
          {percent === null ? '–' : Math.round(percent)}
          <small>%</small>
        </span>
        <div
          className={classes.level}
          role="meter"
          aria-label="Charge"
          aria-valuemin={0}
          aria-valuemax={100}
          aria-valuenow={percent ?? undefined}
        >
          <div className={classes.fill} data-tone={toneOf(percent ?? 0)} style={{ width: `${percent ?? 0}%` }} />
        </div>
      </div>
      <div className={classes.rest}>
        {rest.map((field) => (
          <span key={field.path.join('.')} title={field.description}>
            {field.name}
            <b>
              {formatted(field.value, field.unit)} {field.unit}
            </b>
          </span>
        ))}
      </div>
    </div>
  )
}
