import { afterEach, expect, test, vi } from 'vitest'
import { forgetRobot, rememberedRobot, rememberRobot } from './rememberedRobot'

const ROVER = { robotId: 'id', token: 'secret', name: 'Rover' }

afterEach(() => {
  vi.restoreAllMocks()
  localStorage.clear()
})

test('a browser is the same robot until it forgets it', () => {
  expect(rememberedRobot()).toBeNull()
  expect(rememberRobot(ROVER)).toBe(true)
  expect(rememberedRobot()).toEqual(ROVER)
  forgetRobot()
  expect(rememberedRobot()).toBeNull()
})

test.each(['{', '7', 'null', '{"robotId":"id"}', '{"robotId":1,"token":"t","name":"n"}'])('what is no robot is none: %s', (text) => {
  localStorage.setItem('mosaic.sharedRobot', text)
  expect(rememberedRobot()).toBeNull()
})
