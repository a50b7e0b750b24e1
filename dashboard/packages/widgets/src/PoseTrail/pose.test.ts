import { expect, test } from 'vitest'
import { placeOfPose } from './pose'

const ORIENTATION = { x: 0, y: 0, z: 0, w: 1 }

test.each([
  [{ position: { x: 1, y: 2, z: 0 }, orientation: ORIENTATION }, { x: 1, y: 2, headingRad: 0 }],
  [{ pose: { position: { x: 1, y: 2 }, orientation: ORIENTATION } }, { x: 1, y: 2, headingRad: 0 }],
  [{ x: 1, y: 2, theta: 0.5 }, { x: 1, y: 2, headingRad: 0.5 }],
  [{ position: { x: 1, y: 2 } }, { x: 1, y: 2, headingRad: null }],
])('%j is a place', (message, place) => {
  expect(placeOfPose(message)).toEqual(place)
})

test.each([null, 5, {}, { position: { x: 'a', y: 0 } }])('%j is none', (message) => {
  expect(placeOfPose(message)).toBeNull()
})
