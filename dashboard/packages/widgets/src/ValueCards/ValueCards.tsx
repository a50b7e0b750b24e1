import { Fragment } from 'react'
import { Notice } from '../frame/Notice'
import type { WidgetProps } from '../registry/WidgetDefinition'
import { arrivingSchema } from '../schema/arrivingSchema'
import { fieldValues, formatted, type FieldValue } from '../schema/messageFields'
import { groupedFields } from '../schema/groupedFields'
import { fieldsOf } from '../schema/jsonSchema'
import { jsonOf } from '../stores/decode'
import { useLatest } from '../stores/useReceived'
import classes from './ValueCards.module.css'

/** Every value of a message with its name and unit. Before the first message the schema already makes the places. */
export function ValueCards({ entry, store }: WidgetProps) {
  const latest = useLatest(store)
  const schema = arrivingSchema(entry)
  const decoded = latest === null ? null : jsonOf(latest.data)
  if (decoded === null && fieldsOf(schema).length === 0) return <Notice tone="wait" title="No value yet" />
  if (decoded?.ok === false) return <Notice tone="bad" title="The message is not JSON">{decoded.text.slice(0, 120)}</Notice>
  const groups = groupedFields(fieldValues(schema, decoded?.value))
  if (groups.length === 0) return <Notice tone="wait" title="The message is empty" />
  return (
    <div className={classes.root}>
      {groups.map(({ heading, fields }) => (
        <Fragment key={heading}>
          {heading !== '' && <div className={classes.group}>{heading}</div>}
          {fields.map((field) => (
            <Value key={field.path.join('.')} field={field} />
          ))}
        </Fragment>
      ))}
    </div>
  )
}

function Value({ field }: { field: FieldValue }) {
  const { value } = field
  return (
    <dl className={classes.value} title={field.description || field.path.join('.')}>
      <dt className={classes.name}>{field.name}</dt>
      <dd className={classes.number} data-kind={field.kind}>
        {formatted(value, field.unit, field.isInteger)}
        {field.unit !== '' && value != null && <span className={classes.unit}>{field.unit}</span>}
      </dd>
    </dl>
  )
}
