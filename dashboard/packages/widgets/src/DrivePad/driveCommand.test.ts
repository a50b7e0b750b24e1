import { driveOf, type DriveCommand } from '@mosaic/client'
import { describe, expect, test } from 'vitest'
import { commandOf, velocityText } from './driveCommand'
import { INITIAL_DRIVE } from './driveControl'
import { driveStatus } from './driveStatus'
import { ZERO_TWIST, type Twist } from './driveTwist'

const LIMITS = { maxLinearMps: 1, maxAngularRadps: 1 }
const LEFT_AHEAD: Twist = { linear: { x: 0.5, y: 0, z: 0 }, angular: { x: 0, y: 0, z: 0.25 } }

function driveFor(type: string): DriveCommand | null {
  return driveOf({ type, dataType: 'json-u2r' })
}

describe('a command is written as the robot takes it', () => {
  test.each([
    ['ros2-receiver-geometry-Twist', LEFT_AHEAD],
    ['turtlebot-receiver-teleop', { linear_x: 0.5, angular_z: 0.25 }],
    // Its original pad counts a turn to the left as negative.
    ['h1-direction', { lin_vel_x: 0.5, ang_vel_yaw: -0.25 }],
    ['somebody’s own', LEFT_AHEAD],
  ])('%s', (type, message) => expect(commandOf(LEFT_AHEAD, driveFor(type), LIMITS)).toEqual(message))

  test.each(['ros2-receiver-geometry-Twist', 'turtlebot-receiver-teleop', 'h1-direction'])('rest is the zero of %s, without a sign', (type) => {
    const drive = driveFor(type)
    expect(JSON.stringify(commandOf(ZERO_TWIST, drive, LIMITS))).toBe(JSON.stringify(drive?.zero))
  })

  test('a share of what the robot can is a share of the limits', () => {
    const limits = { maxLinearMps: 2, maxAngularRadps: 4 }
    expect(commandOf({ ...ZERO_TWIST, linear: { x: 2, y: 0, z: 0 } }, driveFor('turtlebot-receiver-teleop'), limits)).toEqual({ linear_x: 1, angular_z: 0 })
  })
})

test('speeds that only the robot knows are told in per cent', () => {
  expect(velocityText(0.5, -0.25, driveFor('ros2-receiver-geometry-Twist'), LIMITS)).toBe('0.50 m/s · -0.25 rad/s')
  expect(velocityText(0.5, -0.25, driveFor('h1-direction'), LIMITS)).toBe('50 % ahead · -25 % turn')
})

describe('of a robot that nothing is known to stop', () => {
  const stopsItself = false
  const open = { ...INITIAL_DRIVE, enabled: true }

  test('a lost connection is not told as a stop', () => {
    const lost = { ...INITIAL_DRIVE, stoppedBy: 'disconnected' as const }
    expect(driveStatus(lost).text).toBe('Stopped: the connection was lost')
    expect(driveStatus(lost, { stopsItself })).toMatchObject({ tone: 'blocked', text: expect.stringContaining('may go on as last told') as string })
  })

  test('a zero that did not leave is said', () => {
    expect(driveStatus({ ...open, stoppedBy: 'escape' }, { stopsItself, isBlocked: true }).text).toContain('did not take the zero')
  })

  test('the stop button is said to have sent zeros, no more', () => {
    expect(driveStatus({ ...open, stoppedBy: 'stop-button' }, { stopsItself }).text).toBe('Zeros sent; not confirmed')
    expect(driveStatus({ ...open, stoppedBy: 'stop-button' }).text).toBe('Stopped by the stop button')
  })
})
