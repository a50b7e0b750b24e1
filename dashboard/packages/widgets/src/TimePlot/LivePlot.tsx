import 'uplot/dist/uPlot.min.css'
import { ActionIcon, SegmentedControl, Tooltip, useComputedColorScheme } from '@mantine/core'
import { nowMs } from '@mosaic/client'
import { IconPlayerPause, IconPlayerPlay } from '@tabler/icons-react'
import { useEffect, useRef, useState } from 'react'
import uPlot from 'uplot'
import type { Field } from '../schema/jsonSchema'
import { plotOptions, type PlotLook } from './plotOptions'
import type { SeriesBuffer } from './SeriesBuffer'
import classes from './TimePlot.module.css'

/** Twelve pictures a second look alive and leave the processor to the video. */
const PERIOD_MS = 80

const WINDOWS = [
  { value: '10', label: '10 s' },
  { value: '30', label: '30 s' },
  { value: '120', label: '2 min' },
  { value: '600', label: '10 min' },
]

export const KEPT_S = 600

/** By unit, what its scale has to show at least. */
export type Limits = Readonly<Record<string, readonly number[]>>
export const NO_LIMITS: Limits = {}

export interface LivePlotProps {
  fields: readonly Field[]
  limits?: Limits
  buffer: SeriesBuffer
  name: string
}

/** A running plot of what is in the buffer; it can be held to look closer while the buffer goes on filling. */
export function LivePlot({ fields, buffer, name, limits = NO_LIMITS }: LivePlotProps) {
  const [windowS, setWindowS] = useState('30')
  const [pausedAtS, setPausedAtS] = useState<number | null>(null)
  const target = useRef<HTMLDivElement>(null)
  const scheme = useComputedColorScheme('dark')
  useEffect(() => {
    if (target.current === null) return undefined
    return runningPlot(target.current, fields, buffer, limits, Number(windowS), pausedAtS)
    // The plot takes its colours when it is made: another scheme makes another plot.
  }, [fields, buffer, limits, windowS, pausedAtS, scheme])
  const isPaused = pausedAtS !== null
  return (
    <div className={classes.root}>
      <div className={classes.tools}>
        <SegmentedControl size="xs" value={windowS} onChange={setWindowS} data={WINDOWS} aria-label="Length of the window" />
        <Tooltip label={isPaused ? 'Go on' : 'Hold the plot'} openDelay={400}>
          <ActionIcon
            variant={isPaused ? 'filled' : 'default'}
            size={28}
            aria-label={isPaused ? 'Go on' : 'Hold the plot'}
            aria-pressed={isPaused}
            onClick={() => setPausedAtS(isPaused ? null : nowMs() / 1000)}
          >
            {isPaused ? <IconPlayerPlay size={15} /> : <IconPlayerPause size={15} />}
          </ActionIcon>
        </Tooltip>
      </div>
      <div ref={target} className={classes.plot} role="img" aria-label={`Plot of ${name}`} />
    </div>
  )
}

function runningPlot(
  target: HTMLElement,
  fields: readonly Field[],
  buffer: SeriesBuffer,
  limits: Limits,
  windowS: number,
  pausedAtS: number | null,
): () => void {
  const data = () => buffer.window(pausedAtS ?? nowMs() / 1000, windowS)
  const plot = new uPlot({ ...plotOptions(fields, lookOf(target), windowS, (unit) => limits[unit] ?? []), ...sizeOf(target) }, data(), target)
  const resized = new ResizeObserver(() => plot.setSize(fittedSize(target, plot)))
  resized.observe(target)
  const timer =
    pausedAtS === null
      ? setInterval(() => {
          if (document.hidden) return
          plot.setData(data())
          showNewest(plot)
        }, PERIOD_MS)
      : undefined
  return () => {
    clearInterval(timer)
    resized.disconnect()
    plot.destroy()
  }
}

/** The legend tells the newest values, unless somebody points at older ones. */
function showNewest(plot: uPlot): void {
  const rows = plot.data[0].length
  const isPointedAt = (plot.cursor.left ?? -1) >= 0
  if (rows > 0 && !isPointedAt) plot.setLegend({ idx: rows - 1 }, false)
}

function sizeOf(target: HTMLElement): { width: number; height: number } {
  return { width: Math.max(80, target.clientWidth), height: Math.max(60, target.clientHeight - 30) }
}

/** The legend stands below the plot and takes what it needs. */
function fittedSize(target: HTMLElement, plot: uPlot): { width: number; height: number } {
  const legend = plot.root.querySelector<HTMLElement>('.u-legend')?.offsetHeight ?? 30
  return { width: Math.max(80, target.clientWidth), height: Math.max(60, target.clientHeight - legend) }
}

function lookOf(element: Element): PlotLook {
  const style = getComputedStyle(element)
  const token = (name: string) => style.getPropertyValue(name).trim() || '#888'
  return {
    line: token('--m-line'),
    muted: token('--m-muted'),
    series: [1, 2, 3, 4, 5, 6].map((number) => token(`--m-series-${number}`)),
  }
}
