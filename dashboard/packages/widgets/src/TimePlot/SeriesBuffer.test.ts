import { expect, test } from 'vitest'
import { plotOptions, seriesName } from './plotOptions'
import { firstNotBefore, SeriesBuffer } from './SeriesBuffer'

const field = (path: string, unit: string) => ({
  path: path.split('.'),
  name: path.split('.').at(-1) ?? '',
  kind: 'number' as const,
  unit,
  description: '',
})

test('a window holds its rows and one before, in seconds before now', () => {
  const buffer = new SeriesBuffer(1, 600)
  for (let timeS = 0; timeS <= 100; timeS++) buffer.add(timeS, [timeS * 2])
  const [times, values] = buffer.window(100, 3)
  expect(times).toEqual([-4, -3, -2, -1, 0])
  expect(values).toEqual([192, 194, 196, 198, 200])
})

test('a held plot does not move while values go on coming', () => {
  const buffer = new SeriesBuffer(1, 600)
  for (let timeS = 0; timeS <= 10; timeS++) buffer.add(timeS, [timeS])
  const held = buffer.window(10, 5)
  buffer.add(11, [11])
  expect(buffer.window(10, 5)).toEqual(held)
})

test('time never goes back, and missing values are gaps', () => {
  const buffer = new SeriesBuffer(2, 600)
  buffer.add(5, [1])
  buffer.add(4, [2, 3])
  expect(buffer.window(5, 10)).toEqual([[0, 0], [1, 2], [null, 3]])
})

test('a long pause is a gap in the lines, and a slow sensor has none', () => {
  const valuesOf = (times: readonly number[]) => {
    const buffer = new SeriesBuffer(1, 600)
    for (const timeS of times) buffer.add(timeS, [timeS])
    return buffer.window(100, 200)[1]
  }
  expect(valuesOf([0, 0.1, 0.2, 12, 12.1])).toEqual([0, 0.1, 0.2, null, 12, 12.1])
  expect(valuesOf([0, 0.1, 0.2, 2.1])).toEqual([0, 0.1, 0.2, 2.1])
  expect(valuesOf([0, 10, 20, 50])).toEqual([0, 10, 20, 50])
  expect(valuesOf([0, 10, 20, 90])).toEqual([0, 10, 20, null, 90])
})

test('what is older than kept is forgotten', () => {
  const buffer = new SeriesBuffer(1, 10)
  for (let index = 0; index < 50_000; index++) buffer.add(index / 100, [index])
  expect(buffer.length).toBeLessThan(1600)
  buffer.clear()
  expect(buffer.length).toBe(0)
  expect(buffer.lastS).toBeNull()
})

test('the search finds the first row that is not before', () => {
  expect([0, 1, 1.5, 9].map((timeS) => firstNotBefore([1, 2, 3], timeS))).toEqual([0, 0, 1, 3])
})

test('one scale and one axis per unit, and few lines at first', () => {
  const fields = [field('a', 'V'), field('b', 'V'), field('c', '%'), field('d', 'A'), field('e', 'A')]
  const options = plotOptions(fields, { line: '#111', muted: '#222', series: ['#333'] }, 30)
  expect(options.axes).toHaveLength(4)
  expect(options.series.slice(1).map(({ scale, show }) => [scale, show])).toEqual([
    ['unit:V', true],
    ['unit:V', true],
    ['unit:%', true],
    ['unit:A', true],
    ['unit:A', false],
  ])
})

test('fields with the same name are called by their path', () => {
  const fields = [field('linear.x', ''), field('angular.x', ''), field('speed', '')]
  expect(fields.map((one) => seriesName(one, fields))).toEqual(['linear.x', 'angular.x', 'speed'])
})
