import fc from 'fast-check'
import { expect, test } from 'vitest'
import { eyeOf, fitted, orbited, panned, START, viewProjection, zoomed, type Camera } from './camera'
import type { Vector } from './cloudExtent'

/** Where a place appears: x and y from -1 to 1, `depth` positive in front of the eye. */
function seen(camera: Camera, [x, y, z]: Vector, aspect = 1, origin?: Vector) {
  const m = viewProjection(camera, aspect, origin)
  const row = (index: number) => (m[index] ?? 0) * x + (m[4 + index] ?? 0) * y + (m[8 + index] ?? 0) * z + (m[12 + index] ?? 0)
  const w = row(3)
  return { x: row(0) / w, y: row(1) / w, z: row(2) / w, depth: w }
}

const cameras = fc.record({
  target: fc.tuple(fc.integer({ min: -50, max: 50 }), fc.integer({ min: -50, max: 50 }), fc.integer({ min: -5, max: 5 })),
  yawRad: fc.double({ min: -7, max: 7, noNaN: true }),
  pitchRad: fc.double({ min: -1.5, max: 1.5, noNaN: true }),
  distanceM: fc.double({ min: 0.5, max: 500, noNaN: true }),
})

test('the target stands in the middle, at its distance, whatever the camera', () => {
  fc.assert(
    fc.property(cameras, (camera) => {
      const target = seen(camera, camera.target)
      expect(target.x).toBeCloseTo(0, 3)
      expect(target.y).toBeCloseTo(0, 3)
      expect(target.depth / camera.distanceM).toBeCloseTo(1, 3)
      expect(Math.abs(target.z)).toBeLessThan(1)
    }),
  )
})

test('up is up, right is right, and nearer is larger', () => {
  const camera: Camera = { target: [0, 0, 0], yawRad: Math.PI, pitchRad: 0.2, distanceM: 10 }
  expect(seen(camera, [0, 0, 1]).y).toBeGreaterThan(0)
  expect(seen(camera, [0, -1, 0]).x).toBeGreaterThan(0) // looking along x, the right hand is -y
  expect(seen(camera, [0, 1, 0]).x).toBeLessThan(0)
  expect(Math.abs(seen(camera, [-5, 1, 0]).x)).toBeGreaterThan(Math.abs(seen(camera, [5, 1, 0]).x))
})

test('a wide picture shows more at the sides', () => {
  expect(seen(START, [0, 3, 0], 2).x).toBeCloseTo(seen(START, [0, 3, 0], 1).x / 2)
})

test('coordinates of a map keep their precision when they are given relative to an origin', () => {
  const origin: Vector = [4_500_000, 600_000, 100]
  const camera = { ...START, target: origin }
  expect(seen(camera, [0.01, 0, 0], 1, origin).x).toBeCloseTo(seen(START, [0.01, 0, 0]).x, 6)
})

test('fitted, everything within the radius is inside the picture', () => {
  fc.assert(
    fc.property(cameras, fc.double({ min: 0.2, max: 300, noNaN: true }), fc.double({ min: 0.4, max: 3, noNaN: true }), (camera, radius, aspect) => {
      const shown = fitted(camera, [1, 2, 3], radius, aspect)
      const corner = seen(shown, [1, 2, 3 + radius * 0.8], aspect)
      expect(Math.abs(corner.x)).toBeLessThan(1)
      expect(Math.abs(corner.y)).toBeLessThan(1.05)
    }),
  )
})

test('dragging right turns the scene to the right, down lifts the eye, and neither turns it over', () => {
  const camera: Camera = { target: [0, 0, 0], yawRad: Math.PI, pitchRad: 0, distanceM: 10 }
  const front: Vector = [-1, 0, 0]
  expect(seen(orbited(camera, 0.1, 0), front).x).toBeGreaterThan(0)
  expect(eyeOf(orbited(camera, 0, 0.1))[2]).toBeGreaterThan(0)
  expect(orbited(camera, 0, 99).pitchRad).toBeLessThan(Math.PI / 2)
  expect(orbited(camera, 0, -99).pitchRad).toBeGreaterThan(-Math.PI / 2)
})

test('what is dragged with Shift stays under the finger', () => {
  fc.assert(
    fc.property(cameras, fc.double({ min: -0.3, max: 0.3, noNaN: true }), fc.double({ min: -0.3, max: 0.3, noNaN: true }), (camera, right, down) => {
      const place = seen(panned(camera, right, down), camera.target)
      expect(place.x).toBeCloseTo(2 * right, 2)
      expect(place.y).toBeCloseTo(-2 * down, 2)
    }),
  )
})

test('zoom goes nearer and stops before the target and before infinity', () => {
  expect(zoomed(START, 2).distanceM).toBe(START.distanceM / 2)
  expect(zoomed(START, 1e9).distanceM).toBeGreaterThan(0)
  expect(zoomed(START, 1e-9).distanceM).toBeLessThan(1e6)
})
