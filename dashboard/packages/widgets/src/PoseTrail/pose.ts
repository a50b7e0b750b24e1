/** Where a pose message puts the robot: MOSAIC's `{position, orientation}`, nested under `pose` or not, or `{x, y, theta}`. */
import { quaternionOf, yawOf } from '../paint/quaternion'
import type { Place } from '../paint/Trail'
import { isObject } from '../schema/jsonSchema'

export function placeOfPose(message: unknown): Place | null {
  if (!isObject(message)) return null
  if (isObject(message['pose'])) return placeOfPose(message['pose'])
  const position = isObject(message['position']) ? message['position'] : message
  const { x, y } = position
  if (!isFinite(x) || !isFinite(y)) return null
  const quaternion = quaternionOf(message['orientation'])
  const theta = message['theta']
  return { x, y, headingRad: quaternion !== null ? yawOf(quaternion) : isFinite(theta) ? theta : null }
}

function isFinite(value: unknown): value is number {
  return typeof value === 'number' && Number.isFinite(value)
}
