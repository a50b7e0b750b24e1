import { nowMs, type Readable } from '@mosaic/client'
import { useReadable } from '@mosaic/react'
import { useEffect, useState } from 'react'
import { Notice } from '../frame/Notice'
import type { WidgetProps } from '../registry/WidgetDefinition'
import type { Field } from '../schema/jsonSchema'
import { measuresRoundTrip } from '../stores/storeKinds'
import { KEPT_S, LivePlot } from '../TimePlot/LivePlot'
import { SeriesBuffer } from '../TimePlot/SeriesBuffer'
import classes from './ConnectionCheck.module.css'
import { RoundTrips } from './RoundTrips'

const FIELDS: readonly Field[] = [
  { path: ['roundTripMs'], name: 'Round trip', kind: 'number', unit: 'ms', description: '' },
]

/** How long a message takes to the robot's program and back. */
export function ConnectionCheck({ store, entry }: WidgetProps) {
  if (!measuresRoundTrip(store)) return <Notice tone="bad" title="This connector echoes nothing" />
  return <RoundTrip roundTripMs={store.roundTripMs} name={entry.label} />
}

function RoundTrip({ roundTripMs, name }: { roundTripMs: Readable<number | null>; name: string }) {
  const [buffer] = useState(() => new SeriesBuffer(FIELDS.length, KEPT_S))
  const [trips] = useState(() => new RoundTrips())
  const now = useReadable(roundTripMs)
  useEffect(
    () =>
      roundTripMs.subscribe(() => {
        const value = roundTripMs.get()
        buffer.add(nowMs() / 1000, [value])
        if (value !== null) trips.add(value)
      }),
    [roundTripMs, buffer, trips],
  )
  const summary = trips.summary()
  return (
    <div className={classes.root}>
      <div className={classes.head}>
        <span className={classes.now} data-testid="round-trip-now">
          {now === null ? '–' : now.toFixed(1)}
          <small>ms</small>
        </span>
        {summary !== null && (
          <span>
            least {summary.leastMs.toFixed(1)} · median {summary.medianMs.toFixed(1)} · most {summary.mostMs.toFixed(1)} ms
          </span>
        )}
      </div>
      <LivePlot fields={FIELDS} buffer={buffer} name={`round trip of ${name}`} />
    </div>
  )
}
