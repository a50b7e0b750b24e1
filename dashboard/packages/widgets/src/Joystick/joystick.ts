/** How a stick stands: its axes and buttons with their names. Pure. */
import { isObject } from '../schema/jsonSchema'

export interface StickAxis {
  name: string
  /** -1 to 1; a trigger 0 to 1. */
  value: number
}

export interface StickButton {
  name: string
  isPressed: boolean
}

export interface StickState {
  axes: StickAxis[]
  buttons: StickButton[]
}

/** Null for what tells of no stick. */
export function stickOf(message: unknown): StickState | null {
  if (!isObject(message)) return null
  const [axes, buttons] = [numbers(message['axes']), numbers(message['buttons'])]
  if (axes === null || buttons === null) return null
  const [axisNames, buttonNames] = [message['axis_names'], message['button_names']]
  return {
    axes: axes.map((value, index) => ({ name: nameAt(axisNames, index), value: Math.min(1, Math.max(-1, value)) })),
    buttons: buttons.map((value, index) => ({ name: nameAt(buttonNames, index), isPressed: value !== 0 })),
  }
}

function numbers(list: unknown): number[] | null {
  return Array.isArray(list) && list.every((value) => typeof value === 'number' && Number.isFinite(value)) ? list : null
}

/** ROS has no names: there it is the number. */
function nameAt(names: unknown, index: number): string {
  const name: unknown = Array.isArray(names) ? names[index] : null
  return typeof name === 'string' && name !== '' ? name : String(index)
}

/** Where the bar of an axis begins and how long it is, in per cent of its width: from the middle to the value. */
export function barOf(value: number): { start: number; length: number } {
  return { start: 50 + 50 * Math.min(0, value), length: 50 * Math.abs(value) }
}
