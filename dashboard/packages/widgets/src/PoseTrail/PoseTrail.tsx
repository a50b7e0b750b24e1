import type { Place, Trail } from '../paint/Trail'
import type { WidgetProps } from '../registry/WidgetDefinition'
import { placeOfPose } from './pose'
import { TrailView } from './TrailView'

/** Where the robot is and has been, in its own map. */
export function PoseTrail({ entry, store }: WidgetProps) {
  return <TrailView store={store} name={`Way of ${entry.label}`} placeOf={placeOfPose} textOf={poseText} />
}

export function poseText({ x, y, headingRad }: Place, trail: Trail): string {
  const heading = headingRad === null ? '' : ` · ${Math.round((headingRad * 180) / Math.PI)}°`
  return `x ${x.toFixed(2)} · y ${y.toFixed(2)} m${heading} · way ${trail.lengthM().toFixed(1)} m`
}
