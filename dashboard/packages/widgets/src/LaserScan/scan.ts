/** A laser scan's ranges to points around the robot: x forward, y left, metres. `null`, 0 and NaN are no return. */
import { isObject } from '../schema/jsonSchema'

export interface ScanPoint {
  x: number
  y: number
  rangeM: number
  angleRad: number
}

export interface Scan {
  points: ScanPoint[]
  nearest: ScanPoint | null
  farthestM: number
}

export function scanOf(message: unknown): Scan | null {
  if (!isObject(message) || !Array.isArray(message['ranges'])) return null
  const start = finite(message['angle_min'])
  const step = finite(message['angle_increment'])
  if (start === null || step === null) return null
  const least = finite(message['range_min']) ?? 0
  const most = finite(message['range_max']) ?? Infinity
  const points: ScanPoint[] = []
  ;(message['ranges'] as unknown[]).forEach((range, index) => {
    const rangeM = finite(range)
    if (rangeM === null || rangeM <= 0 || rangeM < least || rangeM > most) return
    const angleRad = start + index * step
    points.push({ x: rangeM * Math.cos(angleRad), y: rangeM * Math.sin(angleRad), rangeM, angleRad })
  })
  return { points, ...extremes(points) }
}

function extremes(points: readonly ScanPoint[]): { nearest: ScanPoint | null; farthestM: number } {
  let nearest: ScanPoint | null = null
  let farthestM = 0
  for (const point of points) {
    if (nearest === null || point.rangeM < nearest.rangeM) nearest = point
    farthestM = Math.max(farthestM, point.rangeM)
  }
  return { nearest, farthestM }
}

const RADII_M = [1, 2, 3, 4, 5, 6, 8, 10, 15, 20, 30, 40, 60, 80, 100]

/** Radius to show: grows at once, shrinks only when much too large, so that the picture doesn't breathe. */
export function shownRadius(farthestM: number, beforeM: number): number {
  const fitting = RADII_M.find((radius) => radius >= farthestM) ?? farthestM
  return fitting > beforeM || farthestM < 0.55 * beforeM ? fitting : beforeM
}

function finite(value: unknown): number | null {
  return typeof value === 'number' && Number.isFinite(value) ? value : null
}
