/** A line of a robot's log as text: its level, who speaks, and what is said. */
import { isObject } from '../schema/jsonSchema'
import { jsonOf, textOf } from '../stores/decode'

export function logTextOf(data: ArrayBuffer): string {
  const decoded = jsonOf(data)
  const message = decoded.ok ? decoded.value : null
  if (!isObject(message) || typeof message['message'] !== 'string') return textOf(data)
  const { level, name, message: said } = message
  const head = [typeof level === 'string' ? level.toUpperCase() : '', typeof name === 'string' ? `${name}:` : '']
  return [...head, said].filter((word) => word !== '').join(' ')
}
