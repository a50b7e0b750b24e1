/** Attitude from quaternions, intrinsic z-y-x (yaw, pitch, roll) as REP-103 has it; radians. */
import type { messages } from '@mosaic/protocol'

type Quaternion = messages.Quaternion

export interface Attitude {
  rollRad: number
  pitchRad: number
  yawRad: number
}

export function attitudeOf({ x, y, z, w }: Quaternion): Attitude {
  const sinPitch = Math.max(-1, Math.min(1, 2 * (w * y - z * x)))
  return {
    rollRad: Math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
    pitchRad: Math.asin(sinPitch),
    yawRad: yawOf({ x, y, z, w }),
  }
}

export function yawOf({ x, y, z, w }: Quaternion): number {
  return Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
}

/** `{x, y, z, w}`, or a list in the order w, x, y, z that some robots of MOSAIC send; null for anything else. */
export function quaternionOf(value: unknown): Quaternion | null {
  if (Array.isArray(value)) {
    const [w, x, y, z] = value as unknown[]
    return checked({ x, y, z, w })
  }
  return typeof value === 'object' && value !== null ? checked(value as Record<string, unknown>) : null
}

function checked({ x, y, z, w }: Record<string, unknown>): Quaternion | null {
  if (![x, y, z, w].every((part) => typeof part === 'number' && Number.isFinite(part))) return null
  const parts = { x: x as number, y: y as number, z: z as number, w: w as number }
  const length = Math.hypot(parts.x, parts.y, parts.z, parts.w)
  if (length < 1e-6) return null
  return { x: parts.x / length, y: parts.y / length, z: parts.z / length, w: parts.w / length }
}
