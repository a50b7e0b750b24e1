/** From a pointer on the pad to a stick, and back to where the thumb is drawn. */
import { limited, type Stick } from './driveControl'

export interface Box {
  left: number
  top: number
  width: number
  height: number
}

/** Up is ahead, left is counter-clockwise; the pad's edge is full deflection. */
export function stickAt(clientX: number, clientY: number, pad: Box): Stick {
  const radius = Math.min(pad.width, pad.height) / 2
  if (radius <= 0) return { forward: 0, left: 0 }
  return limited({
    forward: (pad.top + pad.height / 2 - clientY) / radius,
    left: (pad.left + pad.width / 2 - clientX) / radius,
  })
}

/** Offset of the thumb from the middle, in per cent of the pad's width. */
export function thumbOffset(stick: Stick): { xPercent: number; yPercent: number } {
  return { xPercent: -stick.left * 50 || 0, yPercent: -stick.forward * 50 || 0 }
}
