/** Turns a pointer on the pad into a stick, and back to where the thumb is drawn. */
import { limited, type Stick } from '../gamepad/stick'

export interface Box {
  left: number
  top: number
  width: number
  height: number
}

/** How far the thumb travels, as a share of the pad's width: it stays inside the pad. */
const TRAVEL = 0.35

/** Up is ahead, left is counter-clockwise; full deflection is where the thumb touches the pad's edge. */
export function stickAt(clientX: number, clientY: number, pad: Box): Stick {
  const radius = Math.min(pad.width, pad.height) * TRAVEL
  if (radius <= 0) return { forward: 0, left: 0 }
  return limited({
    forward: (pad.top + pad.height / 2 - clientY) / radius,
    left: (pad.left + pad.width / 2 - clientX) / radius,
  })
}

/** Offset of the thumb from the middle, in per cent of the pad's width. Two keys ask for more than the round pad shows. */
export function thumbOffset(asked: Stick): { xPercent: number; yPercent: number } {
  const stick = limited(asked)
  return { xPercent: -stick.left * TRAVEL * 100 || 0, yPercent: -stick.forward * TRAVEL * 100 || 0 }
}
