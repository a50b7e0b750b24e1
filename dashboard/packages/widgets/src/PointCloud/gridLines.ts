/** The grid on the ground and the frame's axes: x red, y green, z blue. The grid's step grows with the distance. */
import { niceStep } from '../paint/niceStep'
import type { Camera } from './camera'

const HALF = 10
const AXES = [
  [1, 0, 0],
  [0, 1, 0],
  [0, 0, 1],
] as const
const AXIS_COLOURS = [
  [0.9, 0.3, 0.27],
  [0.25, 0.7, 0.4],
  [0.3, 0.55, 0.95],
] as const

/** `key` tells whether `vertices()` would differ: x, y, z, red, green, blue, alpha of both ends of each line. */
export function gridLines(
  camera: Camera,
  colour: readonly [number, number, number],
): { key: string; vertices: () => Float32Array<ArrayBuffer> } {
  const step = niceStep(camera.distanceM, HALF)
  const [centerX, centerY] = [0, 1].map((axis) => Math.round((camera.target[axis] ?? 0) / step) * step) as [number, number]
  const key = [step, centerX, centerY, ...colour].join()
  const vertices = () => {
    const out: number[] = []
    const line = (from: readonly number[], to: readonly number[], rgb: readonly number[], alpha: number) =>
      out.push(...from, ...rgb, alpha, ...to, ...rgb, alpha)
    for (let index = -HALF; index <= HALF; index++) {
      const [x, y, reach] = [centerX + index * step, centerY + index * step, HALF * step]
      line([x, centerY - reach, 0], [x, centerY + reach, 0], colour, 0.5)
      line([centerX - reach, y, 0], [centerX + reach, y, 0], colour, 0.5)
    }
    AXES.forEach((axis, index) => line([0, 0, 0], axis.map((part) => part * step), AXIS_COLOURS[index] ?? colour, 1))
    return Float32Array.from(out)
  }
  return { key, vertices }
}
