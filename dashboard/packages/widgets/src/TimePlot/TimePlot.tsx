import { nowMs } from '@mosaic/client'
import { useMemo, useState } from 'react'
import { Notice } from '../frame/Notice'
import type { WidgetProps } from '../registry/WidgetDefinition'
import { arrivingSchema } from '../schema/arrivingSchema'
import { fieldsOf, type Field } from '../schema/jsonSchema'
import { numericFields, valueAt } from '../schema/messageFields'
import { useEveryJson } from '../stores/useReceived'
import { KEPT_S, LivePlot } from './LivePlot'
import { SeriesBuffer } from './SeriesBuffer'

/** Every number of the messages over time. */
export function TimePlot({ entry, store }: WidgetProps) {
  const schema = arrivingSchema(entry)
  const declared = useMemo(() => numericFields(schema, undefined), [schema])
  // Messages tell what there is without a schema, and which of the fields that may be left out are not.
  const [found, setFound] = useState<readonly Field[]>([])
  const fields = found.length > 0 ? found : declared
  const buffer = useMemo(() => new SeriesBuffer(fields.length, KEPT_S), [fields])
  useEveryJson(store, (message, info) => {
    const there = allOf(fields, numericFields(schema, message))
    if (there.length > fields.length) return setFound(there)
    const values = fields.map((field) => numberAt(message, field))
    buffer.add((info?.receivedAtMs ?? nowMs()) / 1000, values)
  })
  if (fields.length === 0) {
    const hasSchema = fieldsOf(schema).length > 0
    return <Notice tone="wait" title={hasSchema ? 'Nothing to plot: no field is a number' : 'No value yet'} />
  }
  return <LivePlot fields={fields} buffer={buffer} name={entry.label} />
}

/** More lines than this no legend holds. */
const MAX_FIELDS = 96

/** Fields that come and go keep their lines. */
function allOf(known: readonly Field[], there: readonly Field[]): readonly Field[] {
  const keys = new Set(known.map(keyOf))
  return [...known, ...there.filter((field) => !keys.has(keyOf(field)))].slice(0, MAX_FIELDS)
}

function keyOf({ path }: Field): string {
  return path.join('.')
}

function numberAt(message: unknown, field: Field): number | null {
  const value = valueAt(message, field.path)
  return typeof value === 'number' ? value : null
}
