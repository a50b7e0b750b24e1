import fc from 'fast-check'
import { expect, test, vi } from 'vitest'
import { imuOf, quaternionOf, upOf } from '../src/sensors/attitude'
import { battery, batteryStateOf, browserGetBattery } from '../src/sensors/battery'
import { captureProblem } from '../src/sensors/capture'
import { askForMotion } from '../src/sensors/motion'
import { fixOf } from '../src/sensors/position'

const LEVEL = { alpha: 0, beta: 0, gamma: 0 }

test('a phone that lies flat is turned by nothing, and up is out of its screen', () => {
  expect(quaternionOf(LEVEL)).toEqual({ x: 0, y: 0, z: 0, w: 1 })
  expect(upOf({ x: 0, y: 0, z: 0, w: 1 })).toEqual({ x: 0, y: 0, z: 1 })
})

test('a phone that stands has up at the top of its screen; one on its right side, at its left', () => {
  const standing = quaternionOf({ alpha: 30, beta: 90, gamma: 0 })
  expect(standing && upOf(standing)).toMatchObject({ x: expect.closeTo(0) as number, y: expect.closeTo(1) as number, z: expect.closeTo(0) as number })
  const onItsSide = quaternionOf({ alpha: 0, beta: 0, gamma: 90 })
  expect(onItsSide && upOf(onItsSide)).toMatchObject({ x: expect.closeTo(-1) as number, z: expect.closeTo(0) as number })
})

test('every attitude has length 1', () => {
  const angle = fc.double({ min: -360, max: 360, noNaN: true })
  fc.assert(
    fc.property(angle, angle, angle, (alpha, beta, gamma) => {
      const found = quaternionOf({ alpha, beta, gamma })
      expect(found && Math.hypot(found.x, found.y, found.z, found.w)).toBeCloseTo(1)
    }),
  )
})

test('a compass that is missing is north; a device without sensors tells nothing', () => {
  expect(quaternionOf({ alpha: null, beta: 0, gamma: 0 })).toEqual(quaternionOf(LEVEL))
  expect(quaternionOf({ alpha: 0, beta: null, gamma: 0 })).toBeNull()
  expect(imuOf({ accelerationIncludingGravity: null, rotationRate: null }, null, 0)).toBeNull()
  expect(imuOf({ accelerationIncludingGravity: { x: null, y: 0, z: 0 }, rotationRate: null }, null, 0)).toBeNull()
})

test('gravity is felt upwards, whichever sign the system gives it', () => {
  const attitude = quaternionOf(LEVEL)
  for (const z of [9.8, -9.8]) {
    const imu = imuOf({ accelerationIncludingGravity: { x: 0, y: 0, z }, rotationRate: { alpha: 180, beta: 0, gamma: 90 } }, attitude, 7)
    expect(imu?.linear_acceleration.z).toBeCloseTo(9.8)
    expect(imu?.angular_velocity).toEqual({ x: 0, y: expect.closeTo(Math.PI / 2) as number, z: expect.closeTo(Math.PI) as number })
    expect(imu).toMatchObject({ orientation: attitude, frame_id: 'device', timestamp: 7 })
  }
})

test('a fall is no upside-down, and without an attitude nothing is guessed', () => {
  const fall = { accelerationIncludingGravity: { x: 0, y: 0, z: -1 }, rotationRate: null }
  expect(imuOf(fall, quaternionOf(LEVEL), 0)?.linear_acceleration.z).toBe(-1)
  const down = { accelerationIncludingGravity: { x: 0, y: 0, z: -9.8 }, rotationRate: null }
  expect(imuOf(down, null, 0)).toMatchObject({ linear_acceleration: { z: -9.8 } })
  expect(imuOf(down, null, 0)).not.toHaveProperty('orientation')
})

test('a position is a fix; speed and course only where they are known', () => {
  const coords = { latitude: 52.5, longitude: 13.4, altitude: null, accuracy: 5, speed: null, heading: null }
  expect(fixOf({ coords, timestamp: 1000 })).toEqual({ latitude: 52.5, longitude: 13.4, altitude: null, accuracy_m: 5, timestamp: 1_000_000 })
  expect(fixOf({ coords: { ...coords, speed: 2, heading: 90 }, timestamp: 0 })).toMatchObject({ speed_mps: 2, course_rad: Math.PI / 2 })
  expect(fixOf({ coords: { ...coords, heading: NaN }, timestamp: 0 })).not.toHaveProperty('course_rad')
})

test('a battery tells its charge at once and on every change, until nobody listens', async () => {
  const manager = Object.assign(new EventTarget(), { level: 0.424, charging: false })
  const tell = vi.fn()
  const end = battery(() => Promise.resolve(manager)).start({ tell, failed: vi.fn() })
  await vi.waitFor(() => expect(tell).toHaveBeenCalledWith(expect.objectContaining({ percent: 42, charging: false })))
  manager.charging = true
  manager.dispatchEvent(new Event('chargingchange'))
  expect(tell).toHaveBeenLastCalledWith(expect.objectContaining({ charging: true }))
  end()
  manager.dispatchEvent(new Event('levelchange'))
  expect(tell).toHaveBeenCalledTimes(2)
  expect(batteryStateOf({ level: 1, charging: true }, 3)).toEqual({ percent: 100, charging: true, timestamp: 3 })
})

test('a browser without a battery has none', () => {
  expect(browserGetBattery({})).toBeNull()
  expect(browserGetBattery({ getBattery: () => Promise.reject(new Error()) })).not.toBeNull()
})

test('leave for motion is asked where it must be', async () => {
  const ask = (answer: string) => Object.assign(() => {}, { requestPermission: () => Promise.resolve(answer) })
  await askForMotion({})
  await askForMotion({ DeviceMotionEvent: () => {}, DeviceOrientationEvent: ask('granted') })
  await expect(askForMotion({ DeviceMotionEvent: ask('denied') })).rejects.toThrow('may not know')
})

test('what keeps a page from the camera is said with a cure', () => {
  expect(captureProblem(new DOMException('', 'NotAllowedError'), 'camera')).toContain('Allow it')
  expect(captureProblem(new DOMException('', 'NotFoundError'), 'microphone')).toContain('No microphone')
  expect(captureProblem(new DOMException('', 'NotReadableError'), 'camera')).toContain('another program')
  expect(captureProblem('odd', 'camera')).toContain('odd')
})
