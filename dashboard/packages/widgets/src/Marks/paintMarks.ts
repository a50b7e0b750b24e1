/** Draws marks over a picture. */
import type { Surface } from '../paint/CanvasPainter'
import type { Marks, Placement, MarkPoint } from './marks'

/** On any picture: bright, with dark beside it. */
const COLOUR = '#ffd84d'
const SHADE = 'rgb(5 7 10 / 75%)'
const FONT_PX = 12

/** What reaches beyond the picture ends at its edge. */
export function paintMarks({ context }: Pick<Surface, 'context'>, marks: Marks, { scale, left, top, width, height }: Placement): void {
  context.save()
  context.beginPath()
  context.rect(left, top, width, height)
  context.clip()
  const at = ({ x, y }: MarkPoint): [number, number] => [left + x * scale, top + y * scale]
  const stroke = (colour: string | null, draw: () => void) => {
    context.lineJoin = 'round'
    for (const [lineWidth, style] of [[4, SHADE], [2, colour ?? COLOUR]] as const) {
      context.lineWidth = lineWidth
      context.strokeStyle = style
      draw()
    }
  }
  for (const box of marks.boxes) {
    const [x, y] = at(box)
    stroke(box.colour, () => context.strokeRect(x, y, box.width * scale, box.height * scale))
    if (box.text !== '') paintText(context, box.text, Math.max(left + 2, x), Math.max(top + FONT_PX + 6, y) - 4, box.colour)
  }
  for (const line of marks.lines) {
    stroke(line.colour, () => {
      context.beginPath()
      line.points.forEach((point, index) => (index === 0 ? context.moveTo(...at(point)) : context.lineTo(...at(point))))
      if (line.isClosed) context.closePath()
      context.stroke()
    })
  }
  for (const mark of marks.texts) paintText(context, mark.text, ...at(mark), mark.colour)
  context.restore()
}

function paintText(context: CanvasRenderingContext2D, text: string, x: number, y: number, colour: string | null): void {
  context.font = `600 ${FONT_PX}px Inter Variable, sans-serif`
  context.fillStyle = SHADE
  context.fillRect(x - 2, y - FONT_PX, context.measureText(text).width + 6, FONT_PX + 5)
  context.fillStyle = colour ?? COLOUR
  context.fillText(text, x + 1, y)
}
