import { IconCrosshair, IconEraser, IconMaximize } from '@tabler/icons-react'
import { useEffect, useRef, useState } from 'react'
import frame from '../frame/frame.module.css'
import { Notice } from '../frame/Notice'
import { Tool } from '../frame/Tool'
import classes from '../paint/paint.module.css'
import { fittingView, followingView } from '../paint/metricGrid'
import { paintTrail } from '../paint/paintTrail'
import { Trail, type Place } from '../paint/Trail'
import { useCanvas } from '../paint/useCanvas'
import type { AnyStore } from '../stores/storeKinds'
import { useEveryJson } from '../stores/useReceived'

export interface TrailViewProps {
  store: AnyStore
  name: string
  /** Where a message puts the robot; null for a message that says nothing of it. */
  placeOf: (message: unknown) => Place | null
  textOf: (place: Place, trail: Trail) => string
  stepM?: number
}

/** The way something took, on a metric grid. Painted with every message, past React. */
export function TrailView({ store, name, placeOf, textOf, stepM }: TrailViewProps) {
  const [trail] = useState(() => new Trail(stepM))
  const [isFollowing, setIsFollowing] = useState(false)
  const [hasPlace, setHasPlace] = useState(false)
  const foot = useRef<HTMLDivElement>(null)
  const { canvas, repaint } = useCanvas((surface) => {
    const bounds = trail.bounds()
    if (bounds === null || trail.last === null) return
    const view = isFollowing
      ? followingView(trail.last, surface.width, surface.height)
      : fittingView(bounds, surface.width, surface.height)
    paintTrail(surface, trail, view)
  })
  useEffect(repaint, [repaint, isFollowing])
  useEveryJson(store, (message) => {
    const place = placeOf(message)
    if (place === null) return
    trail.add(place)
    setHasPlace(true)
    if (foot.current !== null) foot.current.textContent = textOf(place, trail)
    repaint()
  })
  const clear = () => {
    trail.clear()
    repaint()
  }
  return (
    <div className={classes.root}>
      <canvas ref={canvas} className={classes.canvas} role="img" aria-label={name} />
      <div ref={foot} className={classes.foot} data-testid="trail-text" />
      {hasPlace ? (
        <div className={frame.toolbar}>
          <Tool label={isFollowing ? 'Show the whole way' : 'Follow the robot'} onClick={() => setIsFollowing(!isFollowing)}>
            {isFollowing ? <IconMaximize size={14} /> : <IconCrosshair size={14} />}
          </Tool>
          <Tool label="Forget the way so far" onClick={clear}>
            <IconEraser size={14} />
          </Tool>
        </div>
      ) : (
        <div className={classes.notice}>
          <Notice tone="wait" title="No position yet" />
        </div>
      )}
    </div>
  )
}
