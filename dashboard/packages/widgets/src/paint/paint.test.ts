import fc from 'fast-check'
import { describe, expect, test } from 'vitest'
import { niceStep } from './niceStep'
import { fittingView, followingView } from './metricGrid'
import { attitudeOf, quaternionOf, yawOf } from './quaternion'
import { Trail } from './Trail'

describe('a trail', () => {
  test('keeps only points that can be told apart, and always the newest', () => {
    const trail = new Trail(0.1)
    for (const x of [0, 0.05, 0.2, 0.25]) trail.add({ x, y: 0, headingRad: null })
    expect(trail.points.map(({ x }) => x)).toEqual([0, 0.2])
    expect(trail.last?.x).toBe(0.25)
    expect(trail.bounds()).toEqual({ minX: 0, maxX: 0.25, minY: 0, maxY: 0 })
    expect(trail.lengthM()).toBeCloseTo(0.2)
  })

  test('never grows without bound and still shows the whole way', () => {
    const trail = new Trail(0.5)
    for (let x = 0; x < 20_000; x++) trail.add({ x, y: 0, headingRad: 0 })
    expect(trail.points.length).toBeLessThanOrEqual(4000)
    expect(trail.bounds()?.minX).toBe(0)
  })

  test('forgets the way, not the place', () => {
    const trail = new Trail()
    trail.add({ x: 0, y: 0, headingRad: null })
    trail.add({ x: 5, y: 0, headingRad: null })
    trail.clear()
    expect(trail.points).toHaveLength(1)
    expect(trail.last?.x).toBe(5)
  })

  test('takes no place that is not a number', () => {
    const trail = new Trail()
    trail.add({ x: NaN, y: 0, headingRad: null })
    expect(trail.bounds()).toBeNull()
    trail.clear()
    expect(trail.points).toEqual([])
  })
})

test('a view shows all of the way and at least four metres', () => {
  const view = fittingView({ minX: -1, maxX: 1, minY: 0, maxY: 20 }, 400, 250)
  expect(view).toEqual({ centerX: 0, centerY: 10, scale: 10 })
  expect(fittingView({ minX: 0, maxX: 0, minY: 0, maxY: 0 }, 400, 400).scale).toBe(100)
  expect(followingView({ x: 3, y: 4, headingRad: 0 }, 600, 300)).toEqual({ centerX: 3, centerY: 4, scale: 50 })
})

test('steps are round and never too many', () => {
  expect([niceStep(8, 4), niceStep(10, 4), niceStep(0.3, 4), niceStep(7, 8)]).toEqual([2, 5, 0.1, 1])
  expect(niceStep(0, 4)).toBe(1)
  fc.assert(
    fc.property(fc.double({ min: 1e-3, max: 1e6, noNaN: true }), fc.integer({ min: 1, max: 20 }), (span, parts) => {
      expect(span / niceStep(span, parts)).toBeLessThanOrEqual(parts * (1 + 1e-6))
    }),
  )
})

describe('a quaternion', () => {
  test('turns into roll, pitch and yaw', () => {
    const half = Math.SQRT1_2
    expect(yawOf({ x: 0, y: 0, z: half, w: half })).toBeCloseTo(Math.PI / 2)
    expect(attitudeOf({ x: half, y: 0, z: 0, w: half }).rollRad).toBeCloseTo(Math.PI / 2)
    expect(attitudeOf({ x: 0, y: half, z: 0, w: half }).pitchRad).toBeCloseTo(Math.PI / 2)
  })

  test('is read as an object, or as a list that starts with w', () => {
    expect(quaternionOf({ x: 0, y: 0, z: 0, w: 2 })).toEqual({ x: 0, y: 0, z: 0, w: 1 })
    expect(quaternionOf([1, 0, 0, 0])).toEqual({ x: 0, y: 0, z: 0, w: 1 })
  })

  test.each([null, 'x', [1, 2], { x: 0, y: 0, z: 0, w: 0 }, { x: 0, y: 0, z: 0 }])('is not %j', (value) => {
    expect(quaternionOf(value)).toBeNull()
  })
})
