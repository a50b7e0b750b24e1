import { useState } from 'react'
import type { Place } from '../paint/Trail'
import { TrailView } from '../PoseTrail/TrailView'
import type { WidgetProps } from '../registry/WidgetDefinition'
import { fixOf, fixText, metresFrom, type Fix } from './localFrame'

/** Satellite receivers jitter; closer points are noise. */
const STEP_M = 0.25

/** A position on Earth and the way since the page was opened, north up. No map is loaded from anywhere. */
export function GpsPosition({ entry, store }: WidgetProps) {
  const [frame] = useState(localFrame)
  return (
    <TrailView
      store={store}
      name={`Way of ${entry.label}, north is up`}
      placeOf={frame.placeOf}
      textOf={() => frame.text()}
      stepM={STEP_M}
    />
  )
}

function localFrame(): { placeOf: (message: unknown) => Place | null; text: () => string } {
  let origin: Fix | null = null
  let last: Fix | null = null
  return {
    placeOf: (message) => {
      const fix = fixOf(message)
      if (fix === null) return null
      last = fix
      origin ??= fix
      const { eastM, northM } = metresFrom(origin, fix)
      return { x: eastM, y: northM, headingRad: null }
    },
    text: () => (last === null ? '' : fixText(last)),
  }
}
