/** Where a thumb, the keys or a gamepad point: pure, and never anything but numbers. */

/** Which way, each from -1 to 1: `forward` ahead, `left` counter-clockwise, `sideways` to the left without turning. */
export interface Stick {
  forward: number
  left: number
  sideways?: number
}

/** Deflection that a resting thumb makes. */
const DEAD_ZONE = 0.08

/** The stick inside the unit circle, with a dead zone; anything that is not a number counts as rest. */
export function limited(stick: Stick): Stick {
  const length = Math.hypot(stick.forward, stick.left)
  if (!Number.isFinite(length) || length < DEAD_ZONE) return { forward: 0, left: 0 }
  const scale = length > 1 ? 1 / length : 1
  return { forward: stick.forward * scale, left: stick.left * scale }
}

/** Two sticks of a gamepad are two ways: each within its own range, not both within one circle. */
export function bounded({ forward, left, sideways = 0 }: Stick): Required<Stick> {
  const one = (value: number): number => (Number.isFinite(value) ? clamp(value, -1, 1) : 0)
  return { forward: one(forward), left: one(left), sideways: one(sideways) }
}

export function clamp(value: number, low: number, high: number): number {
  return Number.isFinite(value) ? Math.min(high, Math.max(low, value)) : low
}
