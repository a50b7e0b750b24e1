import fc from 'fast-check'
import { describe, expect, test } from 'vitest'
import { handleDrive, INITIAL_DRIVE, isHeld, LATE_AFTER_MS, needsTicks, TICK_MS, ZEROS_AFTER_STOP, type DriveEvent, type DriveState, type DriveStep, type StopReason } from './driveControl'
import { limited } from '../gamepad/stick'
import { limitsOf, stickOfKeys, ZERO_TWIST, type Twist } from './driveTwist'

const LIMITS = { maxLinearMps: 0.8, maxAngularRadps: 1.5 }
const READY: DriveState = { ...INITIAL_DRIVE, enabled: true, speed: 1 }
const REASONS: StopReason[] = [
  'released',
  'stop-key',
  'blur',
  'hidden',
  'pagehide',
  'disconnected',
  'unmount',
  'pointercancel',
  'lostcapture',
  'late',
  'unplugged',
  'escape',
  'stop-button',
]
/** Ends after which the robot takes nothing more. */
const SILENT_REASONS: StopReason[] = ['lease-lost', 'robot-stopped', 'not-granted']

function run(events: [DriveEvent, number][], from = READY): { state: DriveState; sent: Twist[] } {
  return events.reduce<{ state: DriveState; sent: Twist[] }>(
    ({ state, sent }, [event, nowMs]) => {
      const step = handleDrive(state, event, nowMs, LIMITS)
      return { state: step.state, sent: step.send === null ? sent : [...sent, step.send] }
    },
    { state: from, sent: [] },
  )
}

const twist = (linear: number, angular: number): Twist => ({
  linear: { x: linear, y: 0, z: 0 },
  angular: { x: 0, y: 0, z: angular },
})

const HOLD: [DriveEvent, number] = [{ type: 'keyDown', key: 'forward' }, 1000]
const tick = (nowMs: number): [DriveEvent, number] => [{ type: 'tick' }, nowMs]

describe('holding', () => {
  test('a press is sent at once, then with every tick', () => {
    const { sent } = run([HOLD, tick(1050), tick(1100)])
    expect(sent).toEqual([twist(0.8, 0), twist(0.8, 0), twist(0.8, 0)])
  })

  test('nothing is sent while nobody holds', () => {
    expect(run([tick(1000), tick(1050)]).sent).toEqual([])
  })

  test('nothing is sent before the channel is open', () => {
    expect(run([HOLD, tick(1050)], { ...READY, enabled: false }).sent).toEqual([])
  })

  test('the speed scales what full deflection means', () => {
    expect(run([[{ type: 'speed', speed: 0.5 }, 0], HOLD]).sent).toEqual([twist(0.4, 0)])
  })

  test('a speed that is not a number becomes the least one', () => {
    expect(run([[{ type: 'speed', speed: NaN }, 0]]).state.speed).toBe(0.05)
  })

  test('left is counter-clockwise, and keys add up', () => {
    const { sent } = run([HOLD, [{ type: 'keyDown', key: 'left' }, 1010], tick(1050)])
    expect(sent.at(-1)).toEqual(twist(0.8, 1.5))
  })

  test('opposite keys cancel out', () => {
    expect(stickOfKeys(['forward', 'back', 'right'])).toEqual({ forward: 0, left: -1 })
  })

  test('ticks that queued up do not leave as a burst', () => {
    expect(run([HOLD, tick(1100), tick(1101), tick(1102)]).sent).toHaveLength(2)
  })
})

describe('stopping', () => {
  test.each(REASONS)('%s sends a zero at once and ends the hold', (reason) => {
    const { state, sent } = run([HOLD, [{ type: 'stop', reason }, 1020]])
    expect(sent.at(-1)).toEqual(ZERO_TWIST)
    expect(isHeld(state)).toBe(false)
    expect(state.stoppedBy).toBe(reason)
  })

  test('releasing the last key stops; releasing one of two does not', () => {
    const both: [DriveEvent, number][] = [HOLD, [{ type: 'keyDown', key: 'left' }, 1010]]
    const one = run([...both, [{ type: 'keyUp', key: 'left' }, 1020]])
    expect(isHeld(one.state)).toBe(true)
    const none = run([...both, [{ type: 'keyUp', key: 'left' }, 1020], [{ type: 'keyUp', key: 'forward' }, 1030]])
    expect(none.sent.at(-1)).toEqual(ZERO_TWIST)
  })

  test('the zero is repeated a few times, then the pad is silent so that it blocks no autonomy', () => {
    const ticks = Array.from({ length: 20 }, (_, index) => tick(1100 + index * TICK_MS))
    const { state, sent } = run([HOLD, [{ type: 'stop', reason: 'released' }, 1020], ...ticks])
    expect(sent.slice(1)).toEqual(Array.from({ length: ZEROS_AFTER_STOP }, () => ZERO_TWIST))
    expect(needsTicks(state)).toBe(false)
  })

  test('a tick that comes late stops instead of stretching the hold', () => {
    const { state, sent } = run([HOLD, tick(1000 + LATE_AFTER_MS + 1)])
    expect(sent.at(-1)).toEqual(ZERO_TWIST)
    expect(state.stoppedBy).toBe('late')
  })

  test('a stop while nobody holds sends nothing', () => {
    expect(run([[{ type: 'stop', reason: 'blur' }, 1000]]).sent).toEqual([])
  })

  test('after a disconnection holding does nothing until the channel is open again', () => {
    const cut: [DriveEvent, number][] = [HOLD, [{ type: 'stop', reason: 'disconnected' }, 1020], [HOLD[0], 1030]]
    expect(isHeld(run(cut).state)).toBe(false)
    expect(isHeld(run([...cut, [{ type: 'enabled' }, 1040], [HOLD[0], 1050]]).state)).toBe(true)
  })

  test('a key up that nobody pressed changes nothing', () => {
    expect(run([[{ type: 'keyUp', key: 'left' }, 0]]).state).toBe(READY)
  })
})

describe('limits', () => {
  test('come from the catalogue', () => {
    expect(limitsOf({ max_linear_mps: 0.4, max_angular_radps: 0.9 })).toEqual({ maxLinearMps: 0.4, maxAngularRadps: 0.9 })
  })

  test.each([undefined, {}, { max_linear_mps: 'fast', max_angular_radps: -1 }])('%j means one in SI units', (safety) => {
    expect(limitsOf(safety)).toEqual({ maxLinearMps: 1, maxAngularRadps: 1 })
  })

  test('a resting thumb and a broken number are rest', () => {
    expect(limited({ forward: 0.05, left: 0.02 })).toEqual({ forward: 0, left: 0 })
    expect(limited({ forward: NaN, left: 1 })).toEqual({ forward: 0, left: 0 })
  })
})

describe('the permit', () => {
  const permit = (permit: 'granted' | 'free' | 'refused'): DriveEvent => ({ type: 'permit', permit, reason: 'lease-lost' })

  test.each(SILENT_REASONS)('%s ends a hold and sends nothing', (reason) => {
    const { state, sent } = run([HOLD, [{ type: 'stop', reason }, 1020], tick(1050), tick(1100)])
    expect(sent).toHaveLength(1)
    expect(isHeld(state)).toBe(false)
    expect(needsTicks(state)).toBe(false)
  })

  test('losing it ends the zeros that were still owed', () => {
    const { sent } = run([HOLD, [{ type: 'stop', reason: 'released' }, 1020], [permit('refused'), 1030], tick(1050), tick(1100)])
    expect(sent).toHaveLength(2)
  })

  test('keys and a gamepad add no speed to each other', () => {
    const { sent } = run([[{ type: 'gamepad', stick: { forward: -1, left: 0 } }, 1000], [{ type: 'keyDown', key: 'forward' }, 1010], tick(1050)])
    expect(sent.at(-1)).toEqual(twist(0.8, 0))
  })

  test('ahead and sideways at once are not faster than either', () => {
    const { sent } = run([[{ type: 'gamepad', stick: { forward: 1, left: 0, sideways: 1 } }, 1000]])
    const { x, y } = sent[0]?.linear ?? { x: 0, y: 0 }
    expect(Math.hypot(x, y)).toBeCloseTo(0.8)
  })
})

const event = fc.oneof(
  fc.record({ type: fc.constant('permit' as const), permit: fc.constantFrom('granted' as const, 'free' as const, 'refused' as const), reason: fc.constantFrom('lease-lost' as const, 'robot-stopped' as const) }),
  fc.record({ type: fc.constant('gamepad' as const), stick: fc.record({ forward: fc.double(), left: fc.double(), sideways: fc.double() }) }),
  fc.constant({ type: 'gamepadReleased' as const }),
  fc.record({ type: fc.constant('stick' as const), stick: fc.record({ forward: fc.double(), left: fc.double() }) }),
  fc.record({ type: fc.constantFrom('keyDown' as const, 'keyUp' as const), key: fc.constantFrom('forward' as const, 'back' as const, 'left' as const, 'right' as const) }),
  fc.record({ type: fc.constant('stop' as const), reason: fc.constantFrom(...REASONS) }),
  fc.record({ type: fc.constant('speed' as const), speed: fc.double() }),
  fc.constant({ type: 'tick' as const }),
  fc.constant({ type: 'enabled' as const }),
)

const walk = fc.array(fc.tuple(event, fc.integer({ min: 0, max: 400 })))
type Walk = [DriveEvent, number][]

/** Every step of a walk, with the time it is made at. */
function* stepsOf(walk: Walk, from: DriveState): Generator<DriveStep & { nowMs: number }> {
  let [nowMs, state] = [0, from]
  for (const [event, afterMs] of walk) {
    nowMs += afterMs
    const step = handleDrive(state, event, nowMs, LIMITS)
    state = step.state
    yield { ...step, nowMs }
  }
}

describe('whatever happens', () => {
  test('no command is above the limits, and none is anything but a number', () => {
    fc.assert(
      fc.property(walk, (steps) => {
        for (const { send } of stepsOf(steps, INITIAL_DRIVE)) {
          if (send === null) continue
          expect(Math.abs(send.linear.x)).toBeLessThanOrEqual(LIMITS.maxLinearMps + 1e-9)
          expect(Math.abs(send.angular.z)).toBeLessThanOrEqual(LIMITS.maxAngularRadps + 1e-9)
        }
      }),
    )
  })

  test('after a stop the first thing sent is a zero, until somebody presses again', () => {
    fc.assert(
      fc.property(walk, fc.constantFrom(...REASONS), (steps, reason) => {
        const { state, nowMs } = [...stepsOf(steps, READY)].at(-1) ?? { state: READY, nowMs: 0 }
        const wasHeld = isHeld(state)
        const wasMoving = wasHeld && state.askedMs === null
        const stop = handleDrive(state, { type: 'stop', reason }, nowMs, LIMITS)
        if (wasMoving) expect(stop.send).toEqual(ZERO_TWIST)
        expect(stop.send === null || stop.send === ZERO_TWIST).toBe(true)
        expect(isHeld(stop.state)).toBe(false)
        const later = handleDrive(stop.state, { type: 'tick' }, nowMs + TICK_MS, LIMITS)
        expect(later.send === null || later.send === ZERO_TWIST).toBe(true)
      }),
    )
  })

  test('nothing but zeros leaves without a permit, and a hold from before it was granted by nobody moves nothing', () => {
    fc.assert(
      fc.property(walk, (steps) => {
        for (const { state, send } of stepsOf(steps, INITIAL_DRIVE)) {
          const mayMove = state.permit === 'granted' && state.enabled
          if (send !== null && send !== ZERO_TWIST) expect(mayMove && isHeld(state)).toBe(true)
          if (state.permit === 'refused') expect(isHeld(state)).toBe(false)
          expect(state.askedMs === null || isHeld(state)).toBe(true)
        }
      }),
    )
  })
})
