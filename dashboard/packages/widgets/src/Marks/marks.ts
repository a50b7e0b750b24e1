/** What is marked in a camera's pictures: read with tolerance, and which marks belong to the picture on the screen. Pure. */
import { plainText } from '@mosaic/client'
import { isObject } from '../schema/jsonSchema'

export interface MarkPoint {
  x: number
  y: number
}

export interface BoxMark extends MarkPoint {
  width: number
  height: number
  text: string
  colour: string | null
}

export interface LineMark {
  points: readonly MarkPoint[]
  isClosed: boolean
  colour: string | null
}

export interface TextMark extends MarkPoint {
  text: string
  colour: string | null
}

export interface Marks {
  /** Label of the camera; null: the only one. */
  camera: string | null
  /** The picture that was looked at; null: in pixels of the one that is shown. */
  size: { width: number; height: number } | null
  /** When that picture was captured, on the robot's monotonic clock. */
  capturedUs: number | null
  boxes: readonly BoxMark[]
  lines: readonly LineMark[]
  texts: readonly TextMark[]
}

const MAX_MARKS = 1000

/** Null for what marks nothing. */
export function marksOf(message: unknown): Marks | null {
  if (!isObject(message)) return null
  const { camera, width, height } = message
  const capturedUs = message['captured_at_us']
  if (![message['boxes'], message['lines'], message['texts']].some(Array.isArray)) return null
  return {
    camera: typeof camera === 'string' ? camera : null,
    size: isPositive(width) && isPositive(height) ? { width, height } : null,
    capturedUs: isPositive(capturedUs) ? capturedUs : null,
    boxes: listed(message['boxes'], boxOf),
    lines: listed(message['lines'], lineOf),
    texts: listed(message['texts'], textOf),
  }
}

function listed<T>(value: unknown, read: (item: Record<string, unknown>) => T | null): T[] {
  if (!Array.isArray(value)) return []
  return (value.slice(0, MAX_MARKS) as unknown[]).filter(isObject).map(read).filter((mark) => mark !== null)
}

function boxOf(item: Record<string, unknown>): BoxMark | null {
  const { x, y, width, height, label, score } = item
  if (![x, y, width, height].every(isNumber)) return null
  const sure = isNumber(score) ? `${Math.round(100 * score)} %` : ''
  const text = [typeof label === 'string' ? plainText(label) : '', sure].filter(Boolean).join(' ')
  return { x: x as number, y: y as number, width: width as number, height: height as number, text, colour: colourOf(item) }
}

function lineOf(item: Record<string, unknown>): LineMark | null {
  const points = listed(item['points'], pointOf)
  return points.length === 0 ? null : { points, isClosed: item['closed'] === true, colour: colourOf(item) }
}

function textOf(item: Record<string, unknown>): TextMark | null {
  const point = pointOf(item)
  const { text } = item
  return point === null || typeof text !== 'string' ? null : { ...point, text: plainText(text), colour: colourOf(item) }
}

function pointOf({ x, y }: Record<string, unknown>): MarkPoint | null {
  return isNumber(x) && isNumber(y) ? { x, y } : null
}

function colourOf({ color }: Record<string, unknown>): string | null {
  return typeof color === 'string' && /^#[0-9a-f]{6}$/i.test(color) ? color : null
}

function isNumber(value: unknown): value is number {
  return typeof value === 'number' && Number.isFinite(value)
}

function isPositive(value: unknown): value is number {
  return isNumber(value) && value > 0
}

/** Marks older than the picture by more than this say nothing of it. */
export const WORTH_MS = 1000
/** Clocks and frame times differ by some milliseconds. */
const TOLERANCE_MS = 10
const MAX_KEPT = 60

interface TimedMarks {
  marks: Marks
  /** When their picture was captured, on the page's clock. */
  capturedAtMs: number
}

/** Keeps the newest marks of one connector, until their picture is shown. */
export class MarkLog {
  private kept: TimedMarks[] = []

  add(marks: Marks, capturedAtMs: number): void {
    this.kept = [...this.kept, { marks, capturedAtMs }].sort((one, other) => one.capturedAtMs - other.capturedAtMs).slice(-MAX_KEPT)
  }

  /** Those of the picture that was captured then, or of the last one before it; `lateMs`: by how much. */
  at(capturedAtMs: number): { marks: Marks; lateMs: number } | null {
    const found = this.kept.findLast((one) => one.capturedAtMs <= capturedAtMs + TOLERANCE_MS)
    if (found === undefined || capturedAtMs - found.capturedAtMs > WORTH_MS) return null
    return { marks: found.marks, lateMs: Math.max(0, capturedAtMs - found.capturedAtMs) }
  }
}

/** `2 boxes, 1 line`. */
export function markText({ boxes, lines, texts }: Pick<Marks, 'boxes' | 'lines' | 'texts'>): string {
  const counts = [[boxes.length, 'box', 'boxes'], [lines.length, 'line', 'lines'], [texts.length, 'text', 'texts']] as const
  return counts.filter(([count]) => count > 0).map(([count, one, many]) => `${count} ${count === 1 ? one : many}`).join(', ')
}

export interface Placement {
  scale: number
  left: number
  top: number
  width: number
  height: number
}

/** Where a picture lies on the surface that shows it whole. */
export function placementOf(picture: { width: number; height: number }, surface: { width: number; height: number }): Placement {
  const scale = Math.min(surface.width / picture.width, surface.height / picture.height)
  const [width, height] = [picture.width * scale, picture.height * scale]
  return { scale, left: (surface.width - width) / 2, top: (surface.height - height) / 2, width, height }
}
