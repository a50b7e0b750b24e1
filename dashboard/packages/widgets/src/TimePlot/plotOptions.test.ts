import { expect, test } from 'vitest'
import { axisWidthPx } from './plotOptions'

test('the axis is as wide as its longest label needs', () => {
  expect(axisWidthPx(['−2.5 rad/s', '0 rad/s'])).toBeGreaterThan(axisWidthPx(['0 rad/s']))
  expect(axisWidthPx(['0.0004 m/s²'])).toBeGreaterThanOrEqual(18 + 11 * 6)
})

test('short labels do not make the plot jump', () => {
  expect(axisWidthPx([])).toBe(axisWidthPx(['1 V']))
})
