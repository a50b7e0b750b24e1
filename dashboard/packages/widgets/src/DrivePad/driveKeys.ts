/**
 * Which key means what. Physical positions (`code`) count, so that WASD is a cross on every keyboard layout;
 * a key that somebody types with, or that belongs to a focused control, is never a drive key.
 */
import type { DriveKey } from './driveTwist'

const KEYS: Record<string, DriveKey> = {
  KeyW: 'forward',
  ArrowUp: 'forward',
  KeyS: 'back',
  ArrowDown: 'back',
  KeyA: 'left',
  ArrowLeft: 'left',
  KeyD: 'right',
  ArrowRight: 'right',
}

export interface PressedKey {
  code: string
  ctrlKey: boolean
  altKey: boolean
  metaKey: boolean
  target: EventTarget | null
}

const TYPING = 'input:not([type=range],[type=checkbox],[type=radio],[type=button]), textarea, select, [contenteditable=""], [contenteditable=true]'
const OWNS_ARROWS = '[role=slider],[role=radio],[role=tab],[role=menuitem],[role=option],[role=listbox],[role=menu],input'
const OWNS_SPACE = 'button, a, input, summary, [role=button],[role=switch],[role=menuitem]'

/** The drive key behind a keyboard event, `'stop'` for the space bar, or null where the key is somebody else's. */
export function driveKeyOf(event: PressedKey): DriveKey | 'stop' | 'escape' | null {
  // Whoever hits Escape wants an end, wherever the focus is.
  if (event.code === 'Escape') return 'escape'
  // With Meta held, macOS swallows the key-up: such a hold could not be ended.
  if (event.ctrlKey || event.altKey || event.metaKey) return null
  if (isInside(event.target, TYPING)) return null
  if (event.code === 'Space') return isInside(event.target, OWNS_SPACE) ? null : 'stop'
  if (event.code.startsWith('Arrow') && isInside(event.target, OWNS_ARROWS)) return null
  return KEYS[event.code] ?? null
}

/** The drive key of a key that goes up, wherever the focus went meanwhile. */
export function releasedKeyOf(code: string): DriveKey | null {
  return KEYS[code] ?? null
}

function isInside(target: EventTarget | null, selector: string): boolean {
  return target instanceof Element && target.closest(selector) !== null
}
