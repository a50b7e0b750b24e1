/**
 * The stop key: Escape twice within a moment, or held. Nobody types it, every keyboard has it, a frightened hand finds
 * it, and pressed once it keeps its usual meaning (a dialog closes, the pad lets go).
 */

export const STOP_KEY_TEXT = 'Esc Esc'
/** As long as a hurried double press takes. */
export const TWICE_WITHIN_MS = 700

export interface EscapePress {
  isRepeat: boolean
  atMs: number
}

/** When Escape was last pressed by itself; null where the next press is a first one. */
export type LastEscape = number | null

/** Whether this press stops the robot, and what to remember of it. */
export function escapePressed(last: LastEscape, { isRepeat, atMs }: EscapePress): { stops: boolean; last: LastEscape } {
  // A held key repeats after the keyboard's own delay: long enough to be no accident.
  if (isRepeat) return { stops: last !== null, last: null }
  const isSecond = last !== null && atMs - last <= TWICE_WITHIN_MS
  return isSecond ? { stops: true, last: null } : { stops: false, last: atMs }
}
