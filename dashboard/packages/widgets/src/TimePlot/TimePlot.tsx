import { nowMs } from '@mosaic/client'
import { useMemo, useState } from 'react'
import { Notice } from '../frame/Notice'
import type { WidgetProps } from '../registry/WidgetDefinition'
import { arrivingSchema } from '../schema/arrivingSchema'
import { fieldsOf, type Field } from '../schema/jsonSchema'
import { valueAt } from '../schema/messageFields'
import { useEveryJson } from '../stores/useReceived'
import { curvesOf, limitedFields } from './limits'
import { KEPT_S, LivePlot, NO_LIMITS, type Limits } from './LivePlot'
import { SeriesBuffer } from './SeriesBuffer'
import { useNumericFields } from './useNumericFields'

/** Every number of the messages over time. */
export function TimePlot({ entry, store }: WidgetProps) {
  const schema = arrivingSchema(entry)
  const [fields, learn] = useNumericFields(schema)
  const curves = useMemo(() => curvesOf(fields), [fields])
  const [limits, setLimits] = useState<Limits>(NO_LIMITS)
  const buffer = useMemo(() => new SeriesBuffer(curves.length, KEPT_S), [curves])
  useEveryJson(store, (message, info) => {
    if (learn(message)) return
    setLimits((before) => sameOr(before, limitsIn(message, fields)))
    const values = curves.map((field) => numberAt(message, field))
    buffer.add((info?.receivedAtMs ?? nowMs()) / 1000, values)
  })
  if (fields.length === 0) {
    const hasSchema = fieldsOf(schema).length > 0
    return <Notice tone="wait" title={hasSchema ? 'Nothing to plot: no field is a number' : 'No value yet'} />
  }
  return <LivePlot fields={curves} buffer={buffer} limits={limits} name={entry.label} />
}

/** What the message says of the limits, by unit. */
function limitsIn(message: unknown, fields: readonly Field[]): Limits {
  const found: Record<string, number[]> = {}
  for (const { field, min, max } of limitedFields(fields)) {
    const numbers = [min, max].map((limit) => numberAt(message, limit)).filter((value) => value !== null)
    found[field.unit] = [...(found[field.unit] ?? []), ...numbers]
  }
  return found
}

/** Another plot is made only of other limits. */
function sameOr(before: Limits, now: Limits): Limits {
  return JSON.stringify(before) === JSON.stringify(now) ? before : now
}

function numberAt(message: unknown, field: Field): number | null {
  const value = valueAt(message, field.path)
  return typeof value === 'number' ? value : null
}
