/** How a plot of several fields looks: one scale and one axis per unit. */
import type uPlot from 'uplot'
import type { Field } from '../schema/jsonSchema'
import { formatted } from '../schema/messageFields'
import { scaleRange } from './limits'

export interface PlotLook {
  line: string
  muted: string
  series: readonly string[]
}

/** More lines than this nobody tells apart; the legend switches the others on. */
export const SHOWN_AT_FIRST = 4

/** `limitsOf`: how far the scale of a unit goes at least, asked whenever it is drawn. */
export function plotOptions(
  fields: readonly Field[],
  look: PlotLook,
  windowS: number,
  limitsOf: (unit: string) => readonly number[] = () => [],
): Omit<uPlot.Options, 'width' | 'height'> {
  const units = [...new Set(fields.map((field) => field.unit))]
  const stroke = { stroke: look.muted, font: '11px Inter Variable, sans-serif' }
  const grid = { stroke: look.line, width: 1 }
  return {
    padding: [8, 8, 0, 0],
    cursor: { y: false, points: { size: 6 } },
    legend: { live: true },
    scales: { x: { time: false, range: () => [-windowS, 0] }, ...limitedScales(units, limitsOf) },
    axes: [
      { ...stroke, grid, ticks: grid, size: 24, values: (_plot, splits) => splits.map((split) => `${Math.round(split)} s`) },
      ...units.map((unit, index): uPlot.Axis => ({
        ...stroke,
        scale: scaleOf(unit),
        // uPlot's enum has no values at run time: 3 is left, 1 is right.
        // eslint-disable-next-line @typescript-eslint/no-unsafe-enum-assignment
        side: index === 0 ? 3 : 1,
        size: (_plot, labels: readonly string[] | null) => axisWidthPx(labels ?? []),
        grid: { ...grid, show: index === 0 },
        ticks: grid,
        values: (_plot, splits) => axisNumbers(splits).map((number) => `${number}${unit === '' ? '' : ` ${unit}`}`),
      })),
    ],
    series: [
      { label: 'Time', value: (_plot, value?: number | null) => (value == null ? '–' : `${value.toFixed(1)} s`) },
      ...fields.map((field, index): uPlot.Series => ({
        label: seriesName(field, fields),
        scale: scaleOf(field.unit),
        show: index < SHOWN_AT_FIRST,
        stroke: look.series[index % look.series.length] ?? look.muted,
        width: 1.75,
        points: { show: false },
        spanGaps: false,
        value: (_plot, value?: number | null) => (value == null ? '–' : `${formatted(value, field.unit)} ${field.unit}`.trim()),
      })),
    ],
  }
}

function limitedScales(units: readonly string[], limitsOf: (unit: string) => readonly number[]): uPlot.Scales {
  const limited = units.filter((unit) => limitsOf(unit).length > 0)
  const rangeOf = (unit: string) => (_plot: uPlot, least: number | null, greatest: number | null) => scaleRange(least, greatest, limitsOf(unit))
  return Object.fromEntries(limited.map((unit) => [scaleOf(unit), { range: rangeOf(unit) }]))
}

function scaleOf(unit: string): string {
  return `unit:${unit}`
}

/** The last key, with those before it where two fields would be called the same. */
export function seriesName(field: Field, fields: readonly Field[]): string {
  const isUnique = fields.filter((other) => other.name === field.name).length === 1
  return isUnique ? field.name : field.path.join('.')
}

const DIGIT_PX = 6.6
const TICK_AND_GAP_PX = 18

/** Room for the longest label at 11 px, ticks included; never so little that a plot jumps while its labels grow. */
export function axisWidthPx(labels: readonly string[]): number {
  return Math.max(52, Math.ceil(TICK_AND_GAP_PX + DIGIT_PX * Math.max(0, ...labels.map((label) => label.length))))
}

/** As many digits as keep neighbours apart, and no rounding error of the steps between them. */
export function axisNumbers(splits: readonly number[]): string[] {
  const [first = 0, second = first + 1] = splits
  const decimals = Math.min(100, Math.max(0, 2 - Math.floor(Math.log10(Math.abs(second - first)))))
  return splits.map((split) => String(Number(split.toFixed(decimals))))
}
