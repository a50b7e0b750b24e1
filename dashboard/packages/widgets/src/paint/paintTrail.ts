/** Draws a trail on a metric grid, x to the right and y up. */
import type { Surface } from './CanvasPainter'
import { paintGrid, pixelsOf, type View } from './metricGrid'
import type { Place, Trail } from './Trail'

export function paintTrail(surface: Surface, trail: Trail, view: View): void {
  paintGrid(surface, view)
  paintWay(surface, trail.last === null ? trail.points : [...trail.points, trail.last], view)
  if (trail.last !== null) paintPlace(surface, trail.last, view)
}

/** A line through places. */
export function paintWay(surface: Surface, places: readonly { x: number; y: number }[], view: View, colour = surface.colours.accent): void {
  const { context } = surface
  const { toX, toY } = pixelsOf(surface, view)
  context.strokeStyle = colour
  context.lineWidth = 2
  context.lineJoin = 'round'
  context.beginPath()
  places.forEach(({ x, y }, index) => {
    if (index === 0) context.moveTo(toX(x), toY(y))
    else context.lineTo(toX(x), toY(y))
  })
  context.stroke()
}

/** Something with a heading at its place. */
export function paintPlace(surface: Surface, { x, y, headingRad }: Place, view: View): void {
  const { toX, toY } = pixelsOf(surface, view)
  paintBody(surface, toX(x), toY(y), headingRad)
}

/** An arrow where the heading is known, a dot where it isn't. */
export function paintBody({ context, colours }: Surface, x: number, y: number, headingRad: number | null): void {
  context.save()
  context.translate(x, y)
  context.fillStyle = colours.text
  context.beginPath()
  if (headingRad === null) {
    context.arc(0, 0, 5, 0, 2 * Math.PI)
  } else {
    context.rotate(-headingRad)
    context.moveTo(10, 0)
    context.lineTo(-7, 6)
    context.lineTo(-4, 0)
    context.lineTo(-7, -6)
    context.closePath()
  }
  context.fill()
  context.restore()
}
