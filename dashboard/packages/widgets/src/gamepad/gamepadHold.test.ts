import fc from 'fast-check'
import { describe, expect, test } from 'vitest'
import { disarmed, handleReading, NEW_HOLD, type GamepadHold, type GamepadStep } from './gamepadHold'
import { STANDARD_MAPPING, type GamepadMapping, type GamepadReading } from './gamepadMapping'

const DEAD_MAN = 4
const STOP = 1
const AHEAD = [0, -1, 0, 0]
const REST = [0, 0, 0, 0]

const reading = (axes: number[], ...pressed: number[]): GamepadReading => ({
  axes,
  buttons: Array.from({ length: 17 }, (_, index) => ({ pressed: pressed.includes(index), value: 0 })),
})

function run(readings: (GamepadReading | null)[], mapping: GamepadMapping = STANDARD_MAPPING, from = NEW_HOLD): GamepadStep[] {
  let hold: GamepadHold = from
  return readings.map((one) => {
    const step = handleReading(hold, one, mapping)
    hold = step.hold
    return step
  })
}

const last = (steps: GamepadStep[]): GamepadStep => {
  const step = steps.at(-1)
  if (step === undefined) throw new Error('no steps')
  return step
}

describe('with a dead-man button', () => {
  test('a stick alone drives nowhere', () => {
    expect(run([reading(REST), reading(AHEAD)]).map(({ stick }) => stick)).toEqual([null, null])
  })

  test('held, it drives where the sticks point', () => {
    expect(last(run([reading(REST), reading(AHEAD, DEAD_MAN)])).stick?.forward).toBe(1)
  })

  test('released, driving ends at once, once', () => {
    const steps = run([reading(REST), reading(AHEAD, DEAD_MAN), reading(AHEAD), reading(AHEAD)])
    expect(steps.map(({ hasEnded }) => hasEnded)).toEqual([false, false, true, false])
  })

  test('pressed while the gamepad appears, it does not count until it was released', () => {
    const steps = run([reading(AHEAD, DEAD_MAN), reading(AHEAD, DEAD_MAN), reading(AHEAD), reading(AHEAD, DEAD_MAN)])
    expect(steps.map(({ stick }) => stick !== null)).toEqual([false, false, false, true])
  })
})

test('an unplugged gamepad ends driving, and must be released when it is back', () => {
  const steps = run([reading(REST), reading(AHEAD, DEAD_MAN), null, reading(AHEAD, DEAD_MAN)])
  expect(steps[2]?.hasEnded).toBe(true)
  expect(steps[3]?.stick).toBeNull()
})

test('after an end from elsewhere it must be released first', () => {
  const driving = last(run([reading(REST), reading(AHEAD, DEAD_MAN)])).hold
  const steps = run([reading(AHEAD, DEAD_MAN), reading(AHEAD), reading(AHEAD, DEAD_MAN)], STANDARD_MAPPING, disarmed(driving))
  expect(steps.map(({ stick }) => stick !== null)).toEqual([false, false, true])
})

describe('the stop button', () => {
  test('asks once per press and ends driving', () => {
    const steps = run([reading(REST), reading(AHEAD, DEAD_MAN), reading(AHEAD, DEAD_MAN, STOP), reading(AHEAD, DEAD_MAN, STOP)])
    expect(steps.map(({ asksForStop }) => asksForStop)).toEqual([false, false, true, false])
    expect(steps[2]?.hasEnded).toBe(true)
  })

  test('after it, the dead-man button must be released', () => {
    const steps = run([reading(REST), reading(AHEAD, DEAD_MAN, STOP), reading(AHEAD, DEAD_MAN)])
    expect(last(steps).stick).toBeNull()
  })

  test('pressed while the gamepad appears it does not stop anybody', () => {
    expect(last(run([reading(REST, STOP)])).asksForStop).toBe(false)
  })
})

describe('without a dead-man button', () => {
  const free: GamepadMapping = { ...STANDARD_MAPPING, needsDeadMan: false }

  test('a deflected stick drives, a resting one ends it', () => {
    const steps = run([reading(REST), reading(AHEAD), reading(REST)], free)
    expect(steps.map(({ stick }) => stick?.forward ?? null)).toEqual([null, 1, null])
    expect(last(steps).hasEnded).toBe(true)
  })

  test('a stick that is deflected from the start does not drive', () => {
    expect(last(run([reading(AHEAD), reading(AHEAD)], free)).stick).toBeNull()
  })
})

test('it never drives without the dead-man button, whatever else happens', () => {
  const anything = fc.option(
    fc.record({
      axes: fc.array(fc.double({ min: -1, max: 1 }), { minLength: 4, maxLength: 4 }),
      pressed: fc.subarray([0, STOP, 2, 3, DEAD_MAN]),
    }),
  )
  fc.assert(
    fc.property(fc.array(anything, { maxLength: 60 }), (looks) => {
      let hold = NEW_HOLD
      let wasReleased = false
      for (const look of looks) {
        const step = handleReading(hold, look && reading(look.axes, ...look.pressed), STANDARD_MAPPING)
        hold = step.hold
        if (step.stick !== null) {
          expect(look?.pressed).toContain(DEAD_MAN)
          expect(look?.pressed).not.toContain(STOP)
          expect(wasReleased).toBe(true)
        }
        if (look === null || look.pressed.includes(STOP)) wasReleased = false
        else if (!look.pressed.includes(DEAD_MAN)) wasReleased = true
      }
    }),
  )
})
