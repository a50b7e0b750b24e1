import { IconCrosshair, IconMaximize, IconMinus, IconPlus } from '@tabler/icons-react'
import { useEffect, useMemo, useRef, useState } from 'react'
import frame from '../frame/frame.module.css'
import { Notice } from '../frame/Notice'
import { Tool } from '../frame/Tool'
import { fittingView, followingView, type View } from '../paint/metricGrid'
import classes from '../paint/paint.module.css'
import { useCanvas } from '../paint/useCanvas'
import type { WidgetProps } from '../registry/WidgetDefinition'
import { EachMessage } from '../stores/EachMessage'
import { useEntries } from '../stores/useEntries'
import { useEveryJson } from '../stores/useReceived'
import { boundsOfLayers, inFrame, layerOf, layerText, ON_MAPS, type MapLayer } from './mapLayers'
import { GridPictures, paintMap } from './paintMap'

/** How much nearer or farther one press goes. */
const ZOOM = 1.5
const MAX_ZOOM = ZOOM ** 8

/**
 * A map from above: this connector's grid or path, and what the other connectors of the robot show in the same frame.
 * Painted with every message, past React.
 */
export function MapView({ robotId, entry, store }: WidgetProps) {
  const [layers] = useState(() => new Map<string, MapLayer>())
  const [pictures] = useState(() => new GridPictures())
  const entries = useEntries(robotId, ON_MAPS)
  const others = useMemo(() => entries.filter(({ label }) => label !== entry.label), [entries, entry.label])
  const [state, setState] = useState<'none' | 'shown' | 'unreadable'>('none')
  const [hasPose, setHasPose] = useState(false)
  const [isFollowing, setIsFollowing] = useState(false)
  const [zoom, setZoom] = useState(1)
  const foot = useRef<HTMLDivElement>(null)

  const shown = () => inFrame(layers.values(), layers.get(entry.label)?.frameId ?? '')
  const { canvas, repaint } = useCanvas((surface) => {
    const visible = shown()
    const view = viewOf(visible, isFollowing, surface.width, surface.height)
    if (view !== null) paintMap(surface, visible, { ...view, scale: view.scale * zoom }, pictures)
  })
  useEffect(repaint, [repaint, isFollowing, zoom])

  const show = (label: string, layer: MapLayer) => {
    layers.set(label, layer)
    setHasPose(shown().some(({ kind }) => kind === 'pose'))
    if (foot.current !== null) foot.current.textContent = footText(entry.label, layers)
    repaint()
  }
  useEveryJson(store, (message) => {
    const layer = layerOf(entry.schemaId, message)
    setState(layer === null ? 'unreadable' : 'shown')
    if (layer !== null) show(entry.label, layer)
  })
  return (
    <div className={classes.root}>
      <canvas ref={canvas} className={classes.canvas} role="img" aria-label={`Map of ${entry.label}`} />
      {others.map((other) => (
        <EachMessage
          key={other.label}
          robotId={robotId}
          entry={other}
          onMessage={(message) => {
            const layer = layerOf(other.schemaId, message)
            if (layer !== null) show(other.label, layer)
          }}
        />
      ))}
      <div ref={foot} className={classes.foot} data-testid="map-text" />
      {state === 'shown' ? (
        <div className={frame.toolbar} role="group" aria-label={`Map of ${entry.label}`}>
          <Tool label="Nearer" isDisabled={zoom >= MAX_ZOOM} onClick={() => setZoom(zoom * ZOOM)}>
            <IconPlus size={14} />
          </Tool>
          <Tool label="Farther" isDisabled={zoom <= 1 / MAX_ZOOM} onClick={() => setZoom(zoom / ZOOM)}>
            <IconMinus size={14} />
          </Tool>
          {hasPose && (
            <Tool label="Follow the robot" isOn={isFollowing} onClick={() => setIsFollowing(!isFollowing)}>
              <IconCrosshair size={14} />
            </Tool>
          )}
          <Tool
            label="Show the whole map"
            isDisabled={zoom === 1 && !isFollowing}
            onClick={() => {
              setZoom(1)
              setIsFollowing(false)
            }}
          >
            <IconMaximize size={14} />
          </Tool>
        </div>
      ) : (
        <div className={classes.notice}>
          {state === 'none' ? (
            <Notice tone="wait" title="No map yet" />
          ) : (
            <Notice tone="bad" title="Not a map">
              A grid has resolution, width, height, origin and as many cells; a path has poses.
            </Notice>
          )}
        </div>
      )}
    </div>
  )
}

function viewOf(layers: readonly MapLayer[], isFollowing: boolean, width: number, height: number): View | null {
  const pose = layers.findLast((layer) => layer.kind === 'pose')
  if (isFollowing && pose !== undefined) return followingView(pose.place, width, height)
  const bounds = boundsOfLayers(layers)
  return bounds === null ? null : fittingView(bounds, width, height)
}

/** This connector's own words, and which others can't be shown with it. */
function footText(label: string, layers: ReadonlyMap<string, MapLayer>): string {
  const own = layers.get(label)
  if (own === undefined) return ''
  const elsewhere = [...layers].filter(([, { frameId }]) => frameId !== own.frameId).map(([other, { frameId }]) => `${other} is in ${frameId}`)
  return [layerText(own), ...elsewhere].join(' · ')
}
