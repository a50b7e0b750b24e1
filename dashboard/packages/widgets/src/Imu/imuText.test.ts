import { expect, test } from 'vitest'
import { degreesText, imuOf } from './imuText'

test('both spellings of an inertial measurement are read', () => {
  const objects = imuOf({ orientation: { x: 0, y: 0, z: 0, w: 1 }, angular_velocity: { x: 0, y: -1, z: 2 } })
  const lists = imuOf({ orientation: [1, 0, 0, 0], angular_velocity: [0, -1, 2] })
  expect(lists).toEqual(objects)
  expect(objects?.attitude).toEqual({ rollRad: 0, pitchRad: 0, yawRad: 0 })
  expect(objects?.angularVelocity).toContain('−1.00')
})

test('what is missing is a dash', () => {
  expect(imuOf({})).toEqual({ attitude: null, angularVelocity: '–', acceleration: '–' })
  expect(imuOf('x')).toBeNull()
})

test('a rate that rounds to zero has no sign', () => {
  expect(imuOf({ gyroscope: [-0.001, 0, 0] })?.angularVelocity).not.toContain('−')
})

test('angles are degrees, without a negative zero', () => {
  expect(degreesText(Math.PI / 2)).toBe('90.0°')
  expect(degreesText(-0.0001)).toBe('0.0°')
})
