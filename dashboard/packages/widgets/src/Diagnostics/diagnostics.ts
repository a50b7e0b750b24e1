/** How the parts of a robot are: the newest word of each, the worst first, and what has fallen silent. Pure. */
import { plainText } from '@mosaic/client'
import { isObject } from '../schema/jsonSchema'

/** The worst first. */
export const LEVELS = ['error', 'stale', 'warn', 'ok'] as const
export type Level = (typeof LEVELS)[number]

export interface PartReport {
  name: string
  hardwareId: string
  level: Level
  message: string
  values: readonly (readonly [string, string])[]
  heardAtMs: number
}

/** A part that says nothing for so long is no longer known to be well. */
export const SILENT_AFTER_MS = 10_000
/** A robot with more parts than this is told in part; those heard last stay. */
const MAX_PARTS = 200
const MAX_VALUES = 64

/** Null for what is no report. */
export function partReportOf(message: unknown, heardAtMs: number): PartReport | null {
  if (!isObject(message) || typeof message['name'] !== 'string') return null
  const level = LEVELS.find((one) => one === message['level'])
  if (level === undefined) return null
  const values = isObject(message['values']) ? Object.entries(message['values']) : []
  return {
    name: plainText(message['name']),
    hardwareId: textOf(message['hardware_id']),
    level,
    message: textOf(message['message']),
    values: values.slice(0, MAX_VALUES).map(([key, value]) => [plainText(key), textOf(value)] as const),
    heardAtMs,
  }
}

function textOf(value: unknown): string {
  return typeof value === 'string' ? plainText(value) : value == null ? '' : plainText(JSON.stringify(value))
}

export function keyOfPart({ name, hardwareId }: Pick<PartReport, 'name' | 'hardwareId'>): string {
  return JSON.stringify([hardwareId, name])
}

/** With this word of a part in the place of its last. */
export function withReport(parts: ReadonlyMap<string, PartReport>, report: PartReport): Map<string, PartReport> {
  const next = new Map(parts)
  next.delete(keyOfPart(report))
  next.set(keyOfPart(report), report)
  for (const key of next.keys()) {
    if (next.size <= MAX_PARTS) break
    next.delete(key)
  }
  return next
}

export function isSilent({ heardAtMs }: PartReport, nowMs: number): boolean {
  return nowMs - heardAtMs > SILENT_AFTER_MS
}

/** A part that was well and fell silent is stale; one that was worse stays so. */
export function levelNow(report: PartReport, nowMs: number): Level {
  return report.level !== 'error' && isSilent(report, nowMs) ? 'stale' : report.level
}

export function worstFirst(parts: Iterable<PartReport>, nowMs: number): PartReport[] {
  const rank = (report: PartReport) => LEVELS.indexOf(levelNow(report, nowMs))
  return [...parts].sort((one, other) => rank(one) - rank(other) || one.name.localeCompare(other.name))
}

/** `1 error, 3 ok`. */
export function summaryText(parts: Iterable<PartReport>, nowMs: number): string {
  const levels = [...parts].map((report) => levelNow(report, nowMs))
  return LEVELS.map((level) => [levels.filter((one) => one === level).length, level] as const)
    .filter(([count]) => count > 0)
    .map(([count, level]) => `${count} ${level}`)
    .join(', ')
}
