import { expect, test } from 'vitest'
import { scanOf, shownRadius } from './scan'

const QUARTER = Math.PI / 2

test('ranges become points, forward is x and left is y', () => {
  const scan = scanOf({ angle_min: 0, angle_increment: QUARTER, ranges: [1, 2] })
  expect(scan?.points.map(({ x, y }) => [Math.round(x), Math.round(y)])).toEqual([
    [1, 0],
    [0, 2],
  ])
  expect(scan?.nearest?.rangeM).toBe(1)
  expect(scan?.farthestM).toBe(2)
})

test('null, zero, text and what is out of range are no return', () => {
  const ranges = [null, 0, 'x', 0.05, 9, 3]
  const scan = scanOf({ angle_min: 0, angle_increment: 0.1, range_min: 0.1, range_max: 8, ranges })
  expect(scan?.points.map(({ rangeM }) => rangeM)).toEqual([3])
})

test('a scan without any return is still a scan', () => {
  expect(scanOf({ angle_min: 0, angle_increment: 1, ranges: [null] })).toEqual({ points: [], nearest: null, farthestM: 0 })
})

test.each([null, [], { ranges: 3 }, { ranges: [1] }])('%j is no scan', (message) => {
  expect(scanOf(message)).toBeNull()
})

test('the shown radius grows at once and shrinks with hesitation', () => {
  expect(shownRadius(7.2, 1)).toBe(8)
  expect(shownRadius(5.5, 8)).toBe(8)
  expect(shownRadius(2.2, 8)).toBe(3)
  expect(shownRadius(250, 8)).toBe(250)
})
