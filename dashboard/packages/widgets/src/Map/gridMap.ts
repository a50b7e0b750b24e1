/** An occupancy grid as a picture: which cells are free, which are not, and where they lie. */
import { quaternionOf, yawOf } from '../paint/quaternion'
import { isObject } from '../schema/jsonSchema'
import type { Bounds } from '../paint/Trail'

export interface GridMap {
  resolutionM: number
  columns: number
  rows: number
  /** The corner of the first cell, and how its rows are turned. */
  x: number
  y: number
  yawRad: number
  /** Row after row; 0 free, 100 occupied, -1 unknown. */
  cells: Int8Array
}

/** More is no map that a page can show. */
const MAX_CELLS = 16_000_000

/** Null for what is no grid. */
export function gridMapOf(message: unknown): GridMap | null {
  if (!isObject(message) || !Array.isArray(message['data']) || !isObject(message['origin'])) return null
  const { resolution, width, height, data, origin } = message
  const position = isObject(origin['position']) ? origin['position'] : {}
  if (!isPositive(resolution) || !isPositive(width) || !isPositive(height) || width * height > MAX_CELLS) return null
  if (data.length !== width * height || typeof position['x'] !== 'number' || typeof position['y'] !== 'number') return null
  const quaternion = quaternionOf({ x: 0, y: 0, z: 0, w: 1, ...(isObject(origin['orientation']) ? origin['orientation'] : {}) })
  return {
    resolutionM: resolution,
    columns: width,
    rows: height,
    x: position['x'],
    y: position['y'],
    yawRad: quaternion === null ? 0 : yawOf(quaternion),
    cells: Int8Array.from(data as unknown[], (cell) => (typeof cell === 'number' ? Math.max(-1, Math.min(100, cell)) : -1)),
  }
}

function isPositive(value: unknown): value is number {
  return typeof value === 'number' && Number.isFinite(value) && value > 0
}

export function boundsOfGrid(grid: GridMap): Bounds {
  const [along, across] = [grid.columns * grid.resolutionM, grid.rows * grid.resolutionM]
  const [cos, sin] = [Math.cos(grid.yawRad), Math.sin(grid.yawRad)]
  const corners = [[0, 0], [along, 0], [0, across], [along, across]] as const
  const xs = corners.map(([a, b]) => grid.x + a * cos - b * sin)
  const ys = corners.map(([a, b]) => grid.y + a * sin + b * cos)
  return { minX: Math.min(...xs), maxX: Math.max(...xs), minY: Math.min(...ys), maxY: Math.max(...ys) }
}

export type Rgb = readonly [number, number, number]

/** Pixels, the last row first as pictures have it: unknown cells let the page through, the others mix the two colours. */
export function pixelsOfGrid({ columns, rows, cells }: GridMap, free: Rgb, occupied: Rgb): Uint8ClampedArray<ArrayBuffer> {
  const pixels = new Uint8ClampedArray(4 * columns * rows)
  for (let row = 0; row < rows; row++) {
    for (let column = 0; column < columns; column++) {
      const cell = cells[row * columns + column] ?? -1
      if (cell < 0) continue
      const share = cell / 100
      const at = 4 * ((rows - 1 - row) * columns + column)
      for (let channel = 0; channel < 3; channel++) {
        pixels[at + channel] = (free[channel] ?? 0) * (1 - share) + (occupied[channel] ?? 0) * share
      }
      pixels[at + 3] = 255
    }
  }
  return pixels
}

export interface CellCounts {
  free: number
  occupied: number
  unknown: number
}

/** For people and screen readers: from half on a cell counts as occupied. */
export function countedCells({ cells }: GridMap): CellCounts {
  const counts = { free: 0, occupied: 0, unknown: 0 }
  for (const cell of cells) counts[cell < 0 ? 'unknown' : cell < 50 ? 'free' : 'occupied'] += 1
  return counts
}

/** `#rrggbb` as three numbers. */
export function rgbOfHex(hex: string): Rgb {
  const number = parseInt(hex.slice(1), 16)
  return Number.isNaN(number) ? [128, 128, 128] : [(number >> 16) & 255, (number >> 8) & 255, number & 255]
}
