import { useRef, useState } from 'react'
import { Notice } from '../frame/Notice'
import type { Surface } from '../paint/CanvasPainter'
import { niceStep } from '../paint/niceStep'
import classes from '../paint/paint.module.css'
import { paintBody } from '../paint/paintTrail'
import { useCanvas } from '../paint/useCanvas'
import type { WidgetProps } from '../registry/WidgetDefinition'
import { jsonOf } from '../stores/decode'
import { useEveryMessage } from '../stores/useReceived'
import { decodeScan, isCompactScan } from './compactScan'
import { scanOf, shownRadius, type Scan } from './scan'

/** A laser scan around the robot, forward is up. Painted with every scan, past React. */
export function LaserScan({ entry, store }: WidgetProps) {
  const scan = useRef<Scan | null>(null)
  const radius = useRef(1)
  const foot = useRef<HTMLDivElement>(null)
  const [state, setState] = useState<'none' | 'shown' | 'unreadable'>('none')
  const { canvas, repaint } = useCanvas((surface) => {
    if (scan.current !== null) paintScan(surface, scan.current, radius.current)
  })
  const show = (message: unknown) => {
    const read = scanOf(message)
    setState(read === null ? 'unreadable' : 'shown')
    if (read === null) return
    scan.current = read
    radius.current = shownRadius(read.farthestM, radius.current)
    if (foot.current !== null) foot.current.textContent = nearestText(read)
    repaint()
  }
  const order = useRef({ arrived: 0, shown: 0 })
  useEveryMessage(store, (data) => {
    if (!isCompactScan(data)) {
      const decoded = jsonOf(data)
      show(decoded.ok ? decoded.value : null)
      return
    }
    const number = ++order.current.arrived
    const showInOrder = (message: unknown) => {
      if (number < order.current.shown) return
      order.current.shown = number
      show(message)
    }
    decodeScan(data).then(showInOrder, () => showInOrder(null))
  })
  return (
    <div className={classes.root}>
      <canvas ref={canvas} className={classes.canvas} role="img" aria-label={`Laser scan ${entry.label}, forward is up`} />
      <div ref={foot} className={classes.foot} />
      {state !== 'shown' && (
        <div className={classes.notice}>
          {state === 'none' ? (
            <Notice tone="wait" title="No scan yet" />
          ) : (
            <Notice tone="bad" title="Not a laser scan">
              A scan has ranges, angle_min and angle_increment, or the compact form.
            </Notice>
          )}
        </div>
      )}
    </div>
  )
}

function nearestText({ nearest, points }: Scan): string {
  if (nearest === null) return 'no return'
  return `nearest ${nearest.rangeM.toFixed(2)} m at ${Math.round((nearest.angleRad * 180) / Math.PI)}° · ${points.length} points`
}

function paintScan(surface: Surface, scan: Scan, radiusM: number): void {
  const { context, width, height, colours } = surface
  const scale = (Math.min(width, height) / 2 - 8) / radiusM
  const [centerX, centerY] = [width / 2, height / 2]
  paintRings(surface, radiusM, scale)
  context.fillStyle = colours.accent
  for (const { x, y } of scan.points) context.fillRect(centerX - y * scale - 1.25, centerY - x * scale - 1.25, 2.5, 2.5)
  if (scan.nearest !== null) {
    context.fillStyle = colours.warn
    context.beginPath()
    context.arc(centerX - scan.nearest.y * scale, centerY - scan.nearest.x * scale, 4, 0, 2 * Math.PI)
    context.fill()
  }
  paintBody(surface, centerX, centerY, Math.PI / 2)
}

function paintRings({ context, width, height, colours }: Surface, radiusM: number, scale: number): void {
  const step = niceStep(radiusM, 4)
  context.strokeStyle = colours.line
  context.fillStyle = colours.muted
  context.font = '11px Inter Variable, sans-serif'
  context.lineWidth = 1
  for (let ring = step; ring <= radiusM * 1.001; ring += step) {
    context.beginPath()
    context.arc(width / 2, height / 2, ring * scale, 0, 2 * Math.PI)
    context.stroke()
    context.fillText(`${Number(ring.toPrecision(2))} m`, width / 2 + 4, height / 2 - ring * scale + 12)
  }
}
