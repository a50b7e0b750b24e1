/** How full a battery is, from the spellings that robots use. */
import { isObject } from '../schema/jsonSchema'

export type ChargeTone = 'ok' | 'warn' | 'bad'

export function percentOf(message: unknown): number | null {
  if (!isObject(message)) return null
  const percent = message['percent'] ?? message['percentage'] ?? message['battery_percent']
  return typeof percent === 'number' && Number.isFinite(percent) ? Math.min(100, Math.max(0, percent)) : null
}

/** Below 15 % a robot should be on its way home, below 30 % it should be thought of. */
export function toneOf(percent: number): ChargeTone {
  return percent < 15 ? 'bad' : percent < 30 ? 'warn' : 'ok'
}
