/**
 * When a gamepad drives: while its dead-man button is held, or, where that was switched off, while a stick is deflected.
 * It must be seen released before it counts, so that nothing that was held at an end of driving starts it again.
 */
import { isAtRest, isPressed, stickOfGamepad, type GamepadMapping, type GamepadReading } from './gamepadMapping'
import type { Stick } from './stick'

export interface GamepadHold {
  /** It was seen released since it last ended (or appeared). */
  readonly isArmed: boolean
  readonly isHeld: boolean
  readonly wasStopPressed: boolean
}

export interface GamepadStep {
  hold: GamepadHold
  /** Where to, while it drives; null while it does not. */
  stick: Required<Stick> | null
  /** True on the one reading where driving ended. */
  hasEnded: boolean
  /** True on the one reading where the stop button went down. */
  asksForStop: boolean
}

/** As a gamepad appears: whatever is pressed on it now does not count. */
export const NEW_HOLD: GamepadHold = { isArmed: false, isHeld: false, wasStopPressed: true }

/** One look at the gamepad; `reading` null: it is gone. */
export function handleReading(hold: GamepadHold, reading: GamepadReading | null, mapping: GamepadMapping): GamepadStep {
  if (reading === null) return { hold: NEW_HOLD, stick: null, hasEnded: hold.isHeld, asksForStop: false }
  const stick = stickOfGamepad(reading, mapping)
  const isStopPressed = isPressed(reading, mapping.stopButton)
  const asksForStop = isStopPressed && !hold.wasStopPressed
  const isHolding = wantsToDrive(reading, stick, mapping)
  const isHeld = isHolding && hold.isArmed && !isStopPressed
  const isArmed = isStopPressed ? false : hold.isArmed || !isHolding
  return {
    hold: { isArmed, isHeld, wasStopPressed: isStopPressed },
    stick: isHeld ? stick : null,
    hasEnded: hold.isHeld && !isHeld,
    asksForStop,
  }
}

/** Driving was ended from elsewhere (blur, a stop, a lost lease): the gamepad must be released first. */
export function disarmed(hold: GamepadHold): GamepadHold {
  return { ...hold, isArmed: false, isHeld: false }
}

function wantsToDrive(reading: GamepadReading, stick: Required<Stick>, mapping: GamepadMapping): boolean {
  if (mapping.needsDeadMan) return isPressed(reading, mapping.deadManButton)
  return !isAtRest(stick)
}
