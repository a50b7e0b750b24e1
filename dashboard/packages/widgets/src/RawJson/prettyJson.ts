/** JSON as people read it: objects by line, lists of numbers in one. */
import { jsonOf } from '../stores/decode'

/** A page full is enough; a scan of a thousand ranges helps nobody as text. */
const MAX_ITEMS = 24
const MAX_CHARACTERS = 20_000

export function prettyJson(data: ArrayBuffer): string {
  const decoded = jsonOf(data)
  const text = decoded.ok ? pretty(decoded.value, '') : decoded.text
  return text.length > MAX_CHARACTERS ? `${text.slice(0, MAX_CHARACTERS)}\n…` : text
}

function pretty(value: unknown, indent: string): string {
  const deeper = `${indent}  `
  if (Array.isArray(value)) {
    const items: unknown[] = value
    const shown = items.slice(0, MAX_ITEMS)
    const rest = items.length > shown.length ? `, … ${items.length - shown.length} more` : ''
    if (shown.every((item) => typeof item !== 'object' || item === null)) return `[${shown.map(plain).join(', ')}${rest}]`
    return `[\n${shown.map((item) => deeper + pretty(item, deeper)).join(',\n')}${rest}\n${indent}]`
  }
  if (typeof value !== 'object' || value === null) return plain(value)
  const lines = Object.entries(value).map(([key, item]) => `${deeper}${JSON.stringify(key)}: ${pretty(item, deeper)}`)
  return lines.length === 0 ? '{}' : `{\n${lines.join(',\n')}\n${indent}}`
}

function plain(value: unknown): string {
  return JSON.stringify(value)
}
