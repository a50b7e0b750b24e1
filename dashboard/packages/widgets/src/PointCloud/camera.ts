/** A camera that circles around a point: z is up, angles in radians, metres. Pure; every change is a new camera. */
import type { Vector } from './cloudExtent'

export interface Camera {
  target: Vector
  /** Direction from the target to the eye, counter-clockwise from x. */
  yawRad: number
  /** How far the eye is above the horizon. */
  pitchRad: number
  distanceM: number
}

/** Column by column, as WebGL takes it. */
export type Matrix = Float32Array<ArrayBuffer>

const FIELD_OF_VIEW_RAD = Math.PI / 4
const MAX_PITCH_RAD = Math.PI / 2 - 0.01
const NEAREST_M = 0.05
const FARTHEST_M = 100_000

/** From behind the robot and above, as its driver would look. */
export const START: Camera = { target: [0, 0, 0], yawRad: Math.PI * 0.92, pitchRad: 0.6, distanceM: 10 }

export function fitted(camera: Camera, center: Vector, radiusM: number, aspect: number): Camera {
  const narrow = Math.min(1, aspect)
  const distanceM = (Math.max(radiusM, 0.1) / Math.sin(FIELD_OF_VIEW_RAD / 2) / narrow) * 0.85
  return { ...camera, target: center, distanceM: clamp(distanceM, NEAREST_M, FARTHEST_M) }
}

/** Turn by a way on the screen: its whole height is half a turn. */
export function orbited(camera: Camera, rightShare: number, downShare: number): Camera {
  const pitchRad = clamp(camera.pitchRad + downShare * Math.PI, -MAX_PITCH_RAD, MAX_PITCH_RAD)
  return { ...camera, yawRad: camera.yawRad - rightShare * Math.PI, pitchRad }
}

/** Move what is seen along with a way on the screen, given in screen heights. */
export function panned(camera: Camera, rightShare: number, downShare: number): Camera {
  const heightM = 2 * camera.distanceM * Math.tan(FIELD_OF_VIEW_RAD / 2)
  const { right, up } = axesOf(camera)
  const shift = (axis: 0 | 1 | 2) => (-right[axis] * rightShare + up[axis] * downShare) * heightM
  const [x, y, z] = camera.target
  return { ...camera, target: [x + shift(0), y + shift(1), z + shift(2)] }
}

/** `factor` above 1 goes nearer. */
export function zoomed(camera: Camera, factor: number): Camera {
  return { ...camera, distanceM: clamp(camera.distanceM / factor, NEAREST_M, FARTHEST_M) }
}

export function eyeOf({ target, yawRad, pitchRad, distanceM }: Camera): Vector {
  const level = Math.cos(pitchRad) * distanceM
  return [
    target[0] + Math.cos(yawRad) * level,
    target[1] + Math.sin(yawRad) * level,
    target[2] + Math.sin(pitchRad) * distanceM,
  ]
}

function axesOf({ yawRad, pitchRad }: Camera): { right: Vector; up: Vector; back: Vector } {
  const [sinYaw, cosYaw, sinPitch, cosPitch] = [Math.sin(yawRad), Math.cos(yawRad), Math.sin(pitchRad), Math.cos(pitchRad)]
  return {
    right: [-sinYaw, cosYaw, 0],
    up: [-cosYaw * sinPitch, -sinYaw * sinPitch, cosPitch],
    back: [cosYaw * cosPitch, sinYaw * cosPitch, sinPitch],
  }
}

/** From places relative to `origin` to clip space. Relative, because a map's coordinates are too large for a float. */
export function viewProjection(camera: Camera, aspect: number, origin: Vector = [0, 0, 0]): Matrix {
  const { right, up, back } = axesOf(camera)
  const eye = eyeOf(camera).map((value, axis) => value - (origin[axis] ?? 0)) as unknown as Vector
  const near = Math.max(0.01, camera.distanceM / 200)
  const far = camera.distanceM * 200
  const height = 1 / Math.tan(FIELD_OF_VIEW_RAD / 2)
  const depth = (far + near) / (near - far)
  const out = new Float32Array(16)
  for (let axis = 0; axis < 3; axis++) {
    const toBack = back[axis] as number
    out[4 * axis] = (height / aspect) * (right[axis] as number)
    out[4 * axis + 1] = height * (up[axis] as number)
    out[4 * axis + 2] = depth * toBack
    out[4 * axis + 3] = -toBack
  }
  out[12] = (-height / aspect) * dot(right, eye)
  out[13] = -height * dot(up, eye)
  out[14] = -depth * dot(back, eye) + (2 * far * near) / (near - far)
  out[15] = dot(back, eye)
  return out
}

const dot = (a: Vector, b: Vector) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2]

const clamp = (value: number, least: number, most: number) => Math.min(most, Math.max(least, value))
