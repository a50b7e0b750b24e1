import { expect, test } from 'vitest'
import { fixOf, fixText, metresFrom } from './localFrame'

const fix = (latitudeDeg: number, longitudeDeg: number) => ({ latitudeDeg, longitudeDeg, altitudeM: null })

test('a minute of latitude is a nautical mile, nearly', () => {
  expect(metresFrom(fix(45, 0), fix(45 + 1 / 60, 0)).northM).toBeCloseTo(1852, -1)
})

test('a degree of longitude shrinks towards the pole', () => {
  expect(metresFrom(fix(0, 0), fix(0, 1)).eastM).toBeCloseTo(111_319.5, 0)
  expect(metresFrom(fix(60, 0), fix(60, 1)).eastM).toBeCloseTo(55_800, -2)
})

test('the way across the date line is short', () => {
  expect(metresFrom(fix(0, 179.999), fix(0, -179.999)).eastM).toBeCloseTo(222.6, 0)
})

test.each([
  [{ latitude: 51.5, longitude: -0.1, altitude: 46 }, { latitudeDeg: 51.5, longitudeDeg: -0.1, altitudeM: 46 }],
  [{ lat: 1, lng: 2 }, { latitudeDeg: 1, longitudeDeg: 2, altitudeM: null }],
  [{ coordinate: { lat: 1, lon: 2 } }, { latitudeDeg: 1, longitudeDeg: 2, altitudeM: null }],
])('%j is a fix', (message, expected) => {
  expect(fixOf(message)).toEqual(expected)
})

test.each([null, { latitude: null, longitude: null }, { latitude: 91, longitude: 0 }])('%j is none', (message) => {
  expect(fixOf(message)).toBeNull()
})

test('a fix is written with its hemispheres', () => {
  expect(fixText({ latitudeDeg: -33.8568, longitudeDeg: 151.2153, altitudeM: 4.25 })).toBe('33.856800° S · 151.215300° E · 4.3 m')
})
