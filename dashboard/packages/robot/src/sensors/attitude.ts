/** What the W3C's motion and orientation events say, in our messages. Pure. */
import type { messages } from '@mosaic/protocol'

type Quaternion = messages.Quaternion

interface Vector {
  x: number
  y: number
  z: number
}

const RADIANS = Math.PI / 180
/** Less than this of an axis says nothing of which way is up. */
const CLEAR_MPS2 = 3

/** Angles of a `DeviceOrientationEvent`, in degrees. */
export interface Angles {
  alpha: number | null
  beta: number | null
  gamma: number | null
}

/**
 * The attitude in a frame whose z points up, x to the right of the screen, y to its top: intrinsic rotations about z, x and y
 * (W3C Device Orientation, Z-X'-Y''). Null where the device does not know.
 */
export function quaternionOf({ alpha, beta, gamma }: Angles): Quaternion | null {
  if (beta === null || gamma === null) return null
  const [cz, sz] = halves(alpha ?? 0)
  const [cx, sx] = halves(beta)
  const [cy, sy] = halves(gamma)
  return {
    x: sx * cy * cz - cx * sy * sz,
    y: cx * sy * cz + sx * cy * sz,
    z: cx * cy * sz + sx * sy * cz,
    w: cx * cy * cz - sx * sy * sz,
  }
}

function halves(degrees: number): [cosine: number, sine: number] {
  const half = (degrees * RADIANS) / 2
  return [Math.cos(half), Math.sin(half)]
}

/** Which way is up, in the frame of the device. */
export function upOf({ x, y, z, w }: Quaternion): Vector {
  return { x: 2 * (x * z - w * y), y: 2 * (y * z + w * x), z: 1 - 2 * (x * x + y * y) }
}

/** A `DeviceMotionEvent`, as far as it is used. */
export interface Motion {
  accelerationIncludingGravity: Readonly<Record<'x' | 'y' | 'z', number | null>> | null
  rotationRate: Angles | null
}

/** Null where the device has no such sensors. `timestamp`: microseconds since 1970. */
export function imuOf({ accelerationIncludingGravity: felt, rotationRate }: Motion, orientation: Quaternion | null, timestamp: number): messages.Imu | null {
  if (felt?.x == null || felt.y == null || felt.z == null) return null
  const imu: messages.Imu = {
    angular_velocity: { x: radians(rotationRate?.beta), y: radians(rotationRate?.gamma), z: radians(rotationRate?.alpha) },
    linear_acceleration: upwards({ x: felt.x, y: felt.y, z: felt.z }, orientation),
    frame_id: 'device',
    timestamp,
  }
  return orientation === null ? imu : { ...imu, orientation }
}

/** At rest it feels gravity upwards. Safari on iOS says the opposite: seen by comparing with the attitude. */
function upwards(felt: Vector, orientation: Quaternion | null): Vector {
  if (orientation === null) return felt
  const up = upOf(orientation)
  const along = felt.x * up.x + felt.y * up.y + felt.z * up.z
  return along < -CLEAR_MPS2 ? { x: -felt.x, y: -felt.y, z: -felt.z } : felt
}

function radians(degrees: number | null | undefined): number {
  return (degrees ?? 0) * RADIANS
}
