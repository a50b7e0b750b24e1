/** An inertial measurement as lines to read. */
import { attitudeOf, quaternionOf, type Attitude } from '../paint/quaternion'
import { isObject } from '../schema/jsonSchema'

export interface ImuReading {
  attitude: Attitude | null
  angularVelocity: string
  acceleration: string
}

export function imuOf(message: unknown): ImuReading | null {
  if (!isObject(message)) return null
  const quaternion = quaternionOf(message['orientation'] ?? message['quaternion'])
  return {
    attitude: quaternion === null ? null : attitudeOf(quaternion),
    angularVelocity: axesText(message['angular_velocity'] ?? message['gyroscope']),
    acceleration: axesText(message['linear_acceleration'] ?? message['accelerometer']),
  }
}

export function degreesText(rad: number): string {
  const degrees = ((rad * 180) / Math.PI).toFixed(1)
  return `${degrees === '-0.0' ? '0.0' : degrees}°`
}

function axesText(value: unknown): string {
  const axes: unknown[] = Array.isArray(value) ? value : isObject(value) ? [value['x'], value['y'], value['z']] : []
  return axes.length < 3 ? '–' : axes.slice(0, 3).map(axisText).join('  ')
}

/** The sign has a place of its own, so that nothing moves when it changes. */
function axisText(value: unknown): string {
  if (typeof value !== 'number' || !Number.isFinite(value)) return '–'
  const size = Math.abs(value).toFixed(2)
  return `${value < 0 && Number(size) !== 0 ? '−' : '\u2007'}${size}`
}
