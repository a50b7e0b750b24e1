/** A view of a plane in metres, x to the right and y up, and its grid with a scale. */
import type { Surface } from './CanvasPainter'
import { niceStep } from './niceStep'
import type { Bounds, Place } from './Trail'

export interface View {
  centerX: number
  centerY: number
  /** Pixels per metre. */
  scale: number
}

const MIN_SPAN_M = 4
const MARGIN = 1.25

/** A view that shows all of `bounds`, and at least a few metres. */
export function fittingView(bounds: Bounds, width: number, height: number): View {
  const spanX = Math.max(MIN_SPAN_M, (bounds.maxX - bounds.minX) * MARGIN)
  const spanY = Math.max(MIN_SPAN_M, (bounds.maxY - bounds.minY) * MARGIN)
  return {
    centerX: (bounds.minX + bounds.maxX) / 2,
    centerY: (bounds.minY + bounds.maxY) / 2,
    scale: Math.min(width / spanX, height / spanY),
  }
}

export function followingView(place: Place, width: number, height: number): View {
  return { centerX: place.x, centerY: place.y, scale: Math.min(width, height) / 6 }
}

export type ToPixel = (metres: number) => number

/** Where metres lie on the surface. */
export function pixelsOf(surface: Surface, view: View): { toX: ToPixel; toY: ToPixel } {
  return {
    toX: (x) => surface.width / 2 + (x - view.centerX) * view.scale,
    toY: (y) => surface.height / 2 - (y - view.centerY) * view.scale,
  }
}

export function paintGrid(surface: Surface, view: View): void {
  const { context, width, height, colours } = surface
  const { toX, toY } = pixelsOf(surface, view)
  const step = niceStep(Math.max(width, height) / view.scale, 8)
  context.lineWidth = 1
  context.strokeStyle = colours.line
  context.beginPath()
  for (let x = Math.ceil((view.centerX - width / 2 / view.scale) / step) * step; toX(x) <= width; x += step) {
    context.moveTo(Math.round(toX(x)) + 0.5, 0)
    context.lineTo(Math.round(toX(x)) + 0.5, height)
  }
  for (let y = Math.ceil((view.centerY - height / 2 / view.scale) / step) * step; toY(y) >= 0; y += step) {
    context.moveTo(0, Math.round(toY(y)) + 0.5)
    context.lineTo(width, Math.round(toY(y)) + 0.5)
  }
  context.stroke()
  paintScaleBar(context, colours.muted, step, view.scale, height)
}

function paintScaleBar(context: CanvasRenderingContext2D, colour: string, step: number, scale: number, height: number): void {
  context.strokeStyle = colour
  context.fillStyle = colour
  context.font = '11px Inter Variable, sans-serif'
  context.beginPath()
  context.moveTo(10, height - 14)
  context.lineTo(10, height - 10)
  context.lineTo(10 + step * scale, height - 10)
  context.lineTo(10 + step * scale, height - 14)
  context.stroke()
  context.fillText(`${Number(step.toPrecision(2))} m`, 14, height - 15)
}
