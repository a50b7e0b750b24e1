/** Where most of a cloud is: what the view is fitted to and the colours span. A few far-off points count for nothing. */
import type { PointCloud } from '../clouds/compactCloud'

export type Extremes = readonly [number, number]
export type Vector = readonly [number, number, number]

export interface Extent {
  center: Vector
  /** Half of the diagonal around most points, metres. */
  radiusM: number
  height: Extremes
  distance: Extremes
}

const SAMPLES = 2000
const LEFT_OUT = 0.02

export function extentOf({ positions, count, origin }: PointCloud): Extent {
  const columns: number[][] = [[], [], [], []]
  const step = Math.max(1, Math.floor(count / SAMPLES))
  for (let index = 0; index < count; index += step) {
    const [x, y, z] = [0, 1, 2].map((axis) => (positions[3 * index + axis] ?? 0) + (origin[axis] ?? 0)) as [number, number, number]
    columns[0]?.push(x)
    columns[1]?.push(y)
    columns[2]?.push(z)
    columns[3]?.push(Math.hypot(x, y, z))
  }
  const [x, y, z, distance] = columns.map(mostOf) as [Extremes, Extremes, Extremes, Extremes]
  const radiusM = Math.hypot(x[1] - x[0], y[1] - y[0], z[1] - z[0]) / 2
  return { center: [middle(x), middle(y), middle(z)], radiusM, height: z, distance }
}

function mostOf(values: number[]): Extremes {
  if (values.length === 0) return [0, 0]
  const sorted = Float64Array.from(values).sort()
  const at = (share: number) => sorted[Math.round(share * (sorted.length - 1))] as number
  return [at(LEFT_OUT), at(1 - LEFT_OUT)]
}

const middle = (range: Extremes) => (range[0] + range[1]) / 2

/** The range to show next: it follows slowly, so that colours don't flicker from cloud to cloud. */
export function followed(shown: Extremes | null, next: Extremes): Extremes {
  if (shown === null) return next
  const move = (from: number, to: number) => from + (to - from) * 0.15
  return [move(shown[0], next[0]), move(shown[1], next[1])]
}
