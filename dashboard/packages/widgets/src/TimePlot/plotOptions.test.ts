import { expect, test } from 'vitest'
import { axisNumbers, axisWidthPx, plotOptions } from './plotOptions'

test('every unit has an axis of its own', () => {
  const fields = ['V', 'A', '°C', 'A'].map((unit, index) => ({ path: [`f${index}`], name: `F${index}`, kind: 'number' as const, unit, description: '' }))
  const { axes } = plotOptions(fields, { line: '#000', muted: '#000', series: [] }, 30)
  expect(axes?.slice(1).map(({ scale }) => scale)).toEqual(['unit:V', 'unit:A', 'unit:°C'])
})

test.each([
  [[91.98, 91.9825, 91.985], ['91.98', '91.9825', '91.985']],
  [[0.1, 0.1 + 0.2, 0.5], ['0.1', '0.3', '0.5']],
  [[0, 25_000, 50_000], ['0', '25000', '50000']],
  [[7], ['7']],
])('the labels %j of an axis are %j: each another one', (splits, labels) => expect(axisNumbers(splits)).toEqual(labels))

test('the axis is as wide as its longest label needs', () => {
  expect(axisWidthPx(['−2.5 rad/s', '0 rad/s'])).toBeGreaterThan(axisWidthPx(['0 rad/s']))
  expect(axisWidthPx(['0.0004 m/s²'])).toBeGreaterThanOrEqual(18 + 11 * 6)
})

test('short labels do not make the plot jump', () => {
  expect(axisWidthPx([])).toBe(axisWidthPx(['1 V']))
})
