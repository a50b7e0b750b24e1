import { useCallback, useEffect, useEffectEvent, useRef, type RefObject } from 'react'
import { CanvasPainter, type Paint } from './CanvasPainter'

/** A canvas that is painted on request, never by rendering. */
export function useCanvas(paint: Paint): { canvas: RefObject<HTMLCanvasElement | null>; repaint: () => void } {
  const canvas = useRef<HTMLCanvasElement>(null)
  const painter = useRef<CanvasPainter | null>(null)
  const onPaint = useEffectEvent(paint)
  useEffect(() => {
    if (canvas.current === null) return undefined
    const made = new CanvasPainter(canvas.current, (surface) => onPaint(surface))
    painter.current = made
    return () => {
      made.dispose()
      painter.current = null
    }
  }, [])
  return { canvas, repaint: useCallback(() => painter.current?.request(), []) }
}
