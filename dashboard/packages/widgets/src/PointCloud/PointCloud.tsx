import { ActionIcon, SegmentedControl, Slider } from '@mantine/core'
import type { MessageInfo } from '@mosaic/client'
import { IconFocusCentered } from '@tabler/icons-react'
import { useEffect, useRef, useState } from 'react'
import { Notice } from '../frame/Notice'
import type { WidgetProps } from '../registry/WidgetDefinition'
import { receives } from '../stores/storeKinds'
import { useEveryMessage } from '../stores/useReceived'
import { CloudDecoder } from './CloudDecoder'
import type { ColourMode } from './CloudRenderer'
import { factsText, Rate } from './cloudText'
import { CloudView } from './CloudView'
import { isCompact, type PointCloud as Cloud } from '../clouds/compactCloud'
import { OriginalClouds } from '../clouds/originalCloud'
import classes from './PointCloud.module.css'

const NAMES: Record<ColourMode, string> = { height: 'Height', distance: 'Distance', intensity: 'Intensity', rgb: 'Colour' }

type Phase = 'none' | 'shown' | 'unreadable'

interface Arrival {
  info: MessageInfo | undefined
  bytes: number
}

/** A point cloud to turn, move and zoom. Decoded beside the page and painted past React. */
export function PointCloud({ entry, store }: WidgetProps) {
  const canvas = useRef<HTMLCanvasElement>(null)
  const foot = useRef<HTMLDivElement>(null)
  const parts = useRef<{ view: CloudView; read: (data: ArrayBuffer, info: MessageInfo | undefined) => void; rate: Rate } | null>(null)
  const [phase, setPhase] = useState<Phase>('none')
  const [isDrawable, setIsDrawable] = useState(true)
  const [columns, setColumns] = useState('')
  const [choice, setChoice] = useState<ColourMode | null>(null)
  const [pointSize, setPointSize] = useState(2)
  const modes = modesOf(columns)
  const mode = choice !== null && modes.includes(choice) ? choice : modes.includes('rgb') ? 'rgb' : 'height'

  useEffect(() => {
    if (canvas.current === null) return undefined
    const view = new CloudView(canvas.current, setIsDrawable)
    const rate = new Rate()
    const onCloud = (cloud: Cloud, arrival: Arrival) => {
      view.show(cloud)
      setPhase('shown')
      setColumns(columnsOf(cloud))
      if (foot.current !== null) foot.current.textContent = factsText({ ...factsOf(cloud, arrival), rateHz: rate.rateHz })
    }
    const decoder = new CloudDecoder<Arrival>(onCloud, () => setPhase('unreadable'))
    const originals = new OriginalClouds()
    const gather = (data: ArrayBuffer, info: MessageInfo | undefined) => {
      const { begun } = originals
      try {
        const cloud = originals.take(data)
        if (originals.begun > begun) rate.note(performance.now())
        if (cloud !== null) onCloud(cloud, { info, bytes: originals.sizeBytes })
      } catch {
        setPhase('unreadable')
      }
    }
    const read = (data: ArrayBuffer, info: MessageInfo | undefined) => {
      if (isCompact(data)) decoder.take(data, { info, bytes: data.byteLength })
      else gather(data, info)
    }
    parts.current = { view, read, rate }
    return () => {
      parts.current = null
      decoder.dispose()
      view.dispose()
    }
  }, [])

  useEffect(() => parts.current?.view.setStyle(mode, pointSize), [mode, pointSize])

  const take = (data: ArrayBuffer, info?: MessageInfo) => {
    if (parts.current === null) return
    if (info?.latched !== true && isCompact(data)) parts.current.rate.note(info?.receivedAtMs ?? performance.now())
    if (!document.hidden) parts.current.read(data, info)
  }
  useEveryMessage(store, take)

  useEffect(() => {
    // Clouds are not decoded for a page that nobody sees: the newest is made up for.
    const onVisible = () => {
      const latest = !document.hidden && receives(store) ? store.latest : null
      if (latest !== null) parts.current?.read(latest.data, latest.info)
    }
    document.addEventListener('visibilitychange', onVisible)
    return () => document.removeEventListener('visibilitychange', onVisible)
  }, [store])

  return (
    <div className={classes.root}>
      <div className={classes.bar}>
        <SegmentedControl
          size="xs"
          aria-label="Colour by"
          data={modes.map((value) => ({ value, label: NAMES[value] }))}
          value={mode}
          onChange={(value) => setChoice(value)}
        />
        <Slider
          className={classes.size}
          size="sm"
          min={1}
          max={8}
          step={0.5}
          label={(value) => `${value} px`}
          thumbLabel="Size of a point"
          value={pointSize}
          onChange={setPointSize}
        />
        <ActionIcon variant="subtle" color="gray" aria-label="Fit the view" title="Fit the view (F)" onClick={() => parts.current?.view.fit()}>
          <IconFocusCentered size={18} stroke={1.6} />
        </ActionIcon>
      </div>
      <div className={classes.picture}>
        <canvas
          ref={canvas}
          className={classes.canvas}
          tabIndex={0}
          role="img"
          aria-label={`Point cloud ${entry.label}. Drag to turn, with Shift or two fingers to move, wheel or pinch to zoom; or arrows, plus and minus, F to fit.`}
        />
        <div ref={foot} className={classes.foot} />
        <CloudNotice phase={phase} isDrawable={isDrawable} />
      </div>
    </div>
  )
}

function CloudNotice({ phase, isDrawable }: { phase: Phase; isDrawable: boolean }) {
  if (isDrawable && phase === 'shown') return null
  return (
    <div className={classes.notice}>
      {!isDrawable ? (
        <Notice tone="warn" title="This browser can't draw point clouds now">
          It needs WebGL 2. Turn on hardware acceleration in the browser's settings, or close other pages with 3D pictures.
        </Notice>
      ) : phase === 'none' ? (
        <Notice tone="wait" title="No cloud yet" />
      ) : (
        <Notice tone="bad" title="Not a point cloud">
          The connector's bytes are not in the form that this dashboard reads.
        </Notice>
      )}
    </div>
  )
}

function columnsOf(cloud: Cloud): string {
  return (cloud.intensities === null ? '' : 'i') + (cloud.colours === null ? '' : 'c')
}

function modesOf(columns: string): ColourMode[] {
  const modes: ColourMode[] = ['height', 'distance']
  if (columns.includes('i')) modes.push('intensity')
  if (columns.includes('c')) modes.push('rgb')
  return modes
}

/** The age counts from the capture where the robot told it, else from the sending. */
function factsOf(cloud: Cloud, { info, bytes }: Arrival) {
  const beforeMs = cloud.capturedUs > 0 && info !== undefined && info.stampUs > 0 ? (info.stampUs - cloud.capturedUs) / 1000 : 0
  const ageMs = info === undefined || info.ageMs === null ? null : Math.max(0, info.ageMs + beforeMs)
  return { points: cloud.count, bytes, ageMs }
}
