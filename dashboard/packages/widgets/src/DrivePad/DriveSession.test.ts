// @vitest-environment happy-dom
import { timerTicks } from '@mosaic/client'
import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest'
import { fakeGamepads, setPressed, type FakeGamepads } from '../../test/fakeGamepads'
import { GamepadSource } from '../gamepad/GamepadSource'
import { TICK_MS, ZEROS_AFTER_STOP } from './driveControl'
import { ZERO_TWIST, type Twist } from './driveTwist'
import { restAllPads } from '../control/pads'
import { DriveSession } from './DriveSession'

const LIMITS = { maxLinearMps: 1, maxAngularRadps: 2 }
let sent: Twist[]
let accepts: boolean
let sessions: DriveSession[]
let pads: FakeGamepads
let gamepads: GamepadSource
let leaseAsked: number
let stopsAsked: number

beforeEach(() => {
  vi.useFakeTimers()
  sent = []
  accepts = true
  sessions = []
  leaseAsked = 0
  stopsAsked = 0
  pads = fakeGamepads()
  gamepads = new GamepadSource()
})

afterEach(() => {
  for (const session of sessions) session.dispose()
  gamepads.dispose()
  pads.restore()
  document.body.replaceChildren()
  localStorage.clear()
  vi.useRealTimers()
})

function openSession(): DriveSession {
  const session = new DriveSession({
    limits: LIMITS,
    ticks: timerTicks,
    gamepads,
    robotId: 'r',
    takeLease: () => (leaseAsked += 1),
    stopRobot: () => (stopsAsked += 1),
    send: (twist) => {
      sent.push(twist)
      return accepts
    },
  })
  session.setOpen(true)
  session.setSpeed(1)
  sessions.push(session)
  return session
}

function press(code: string, options: KeyboardEventInit = {}, target: EventTarget = document.body): void {
  target.dispatchEvent(new KeyboardEvent('keydown', { code, bubbles: true, cancelable: true, ...options }))
}

function release(code: string): void {
  document.body.dispatchEvent(new KeyboardEvent('keyup', { code, bubbles: true }))
}

function hide(): void {
  vi.spyOn(document, 'visibilityState', 'get').mockReturnValue('hidden')
  document.dispatchEvent(new Event('visibilitychange'))
  vi.restoreAllMocks()
}

test('a held key commands twenty times a second', () => {
  openSession()
  press('KeyW')
  vi.advanceTimersByTime(1000)
  expect(sent.length).toBeGreaterThanOrEqual(20)
  expect(sent.length).toBeLessThanOrEqual(21)
  expect(sent.at(-1)).toEqual({ linear: { x: 1, y: 0, z: 0 }, angular: { x: 0, y: 0, z: 0 } })
})

test('the clock rests while nobody drives', () => {
  openSession()
  expect(vi.getTimerCount()).toBe(0)
  press('KeyW')
  expect(vi.getTimerCount()).toBe(1)
  release('KeyW')
  vi.advanceTimersByTime(1100)
  expect(vi.getTimerCount()).toBe(0)
})

const STOPS: [string, (session: DriveSession) => void][] = [
  ['the key is released', () => release('KeyW')],
  ['the window loses the focus', () => window.dispatchEvent(new Event('blur'))],
  ['the page is hidden', hide],
  ['the page is left', () => window.dispatchEvent(new Event('pagehide'))],
  ['the page is about to be left', () => window.dispatchEvent(new Event('beforeunload'))],
  ['the connection is lost', (session) => session.setOpen(false)],
  ['the pad is unmounted', (session) => session.dispose()],
  ['the space bar is pressed', () => press('Space')],
  ['a modifier is pressed, whose key-up macOS would swallow', () => press('MetaLeft', { metaKey: true })],
]

describe('a zero is sent at once when', () => {
  test.each(STOPS)('%s', (_name, stop) => {
    const session = openSession()
    press('KeyW')
    vi.advanceTimersByTime(TICK_MS)
    const before = sent.length
    stop(session)
    expect(sent.slice(before)).toEqual([ZERO_TWIST])
    vi.advanceTimersByTime(2000)
    expect(sent.slice(before).every((twist) => twist.linear.x === 0 && twist.angular.z === 0)).toBe(true)
    expect(sent.length - before).toBeLessThanOrEqual(ZEROS_AFTER_STOP)
  })

  test('the stick is released by a lost pointer', () => {
    const session = openSession()
    session.moveStick({ forward: 1, left: 0 })
    session.stop('lostcapture')
    expect(sent.at(-1)).toEqual(ZERO_TWIST)
    expect(session.status.text).toContain('touch was interrupted')
  })
})

test('a key that repeats after a stop does not start again', () => {
  openSession()
  press('KeyW')
  window.dispatchEvent(new Event('blur'))
  press('KeyW', { repeat: true })
  vi.advanceTimersByTime(1000)
  expect(sent.at(-1)).toEqual(ZERO_TWIST)
})

test('a throttled page stops the robot', () => {
  let tick = () => {}
  let nowMs = 0
  const session = new DriveSession({
    limits: LIMITS,
    send: (twist) => sent.push(twist) > 0,
    nowMs: () => nowMs,
    ticks: {
      every: (_periodMs, onTick) => {
        tick = onTick
        return () => {}
      },
    },
  })
  sessions.push(session)
  session.setOpen(true)
  press('KeyW')
  nowMs = 1000
  tick()
  expect(sent.at(-1)).toEqual(ZERO_TWIST)
  expect(session.status).toEqual({ tone: 'stopped', text: 'Stopped: the page was too slow to drive safely' })
})

test.each(['input', 'textarea', 'select'])('typing in a %s never drives', (tag) => {
  openSession()
  const field = document.body.appendChild(document.createElement(tag))
  press('KeyW', {}, field)
  press('ArrowUp', {}, field)
  expect(sent).toEqual([])
})

test('arrows belong to a focused slider, letters still drive', () => {
  openSession()
  const slider = document.body.appendChild(document.createElement('div'))
  slider.setAttribute('role', 'slider')
  press('ArrowUp', {}, slider)
  expect(sent).toEqual([])
  press('KeyW', {}, slider)
  expect(sent).toHaveLength(1)
})

test('the space bar still presses a focused button', () => {
  openSession()
  const button = document.body.appendChild(document.createElement('button'))
  const event = new KeyboardEvent('keydown', { code: 'Space', bubbles: true, cancelable: true })
  button.dispatchEvent(event)
  expect(event.defaultPrevented).toBe(false)
})

test('two pads never obey one key; the one touched last has the keyboard', () => {
  openSession()
  const other = openSession()
  press('KeyW')
  release('KeyW')
  vi.advanceTimersByTime(1000)
  other.moveStick({ forward: 0, left: 1 })
  other.stop('released')
  vi.advanceTimersByTime(1000)
  sent = []
  press('KeyW')
  expect(sent).toHaveLength(1)
  expect(other.get().keys).toEqual(['forward'])
})

test('a link that does not take commands is said', () => {
  const session = openSession()
  accepts = false
  press('KeyW')
  expect(session.status).toEqual({ tone: 'blocked', text: 'The link does not take commands' })
})

test('nothing is heard after the end', () => {
  const session = openSession()
  session.dispose()
  press('KeyW')
  expect(sent).toEqual([])
})

describe('the lease', () => {
  test('a touch while nobody commands asks for it, and nothing moves before it is granted', () => {
    const session = openSession()
    session.setPermit('free', 'lease-lost')
    press('KeyW')
    vi.advanceTimersByTime(200)
    expect(leaseAsked).toBe(1)
    expect(sent).toEqual([])
    expect(session.status.text).toContain('Asking for control')
    session.setPermit('granted', 'lease-lost')
    expect(sent.at(-1)?.linear.x).toBe(1)
  })

  test('a grant that comes after the key was released moves nothing', () => {
    const session = openSession()
    session.setPermit('free', 'lease-lost')
    press('KeyW')
    release('KeyW')
    session.setPermit('granted', 'lease-lost')
    vi.advanceTimersByTime(1000)
    expect(sent).toEqual([])
  })

  test('what is not granted in time is forgotten', () => {
    const session = openSession()
    session.setPermit('free', 'lease-lost')
    press('KeyW')
    vi.advanceTimersByTime(3000)
    session.setPermit('granted', 'lease-lost')
    expect(sent).toEqual([])
    expect(session.get().stoppedBy).toBe('not-granted')
  })

  test('while somebody else commands, a touch does nothing at all', () => {
    openSession().setPermit('refused', 'lease-lost')
    press('KeyW')
    vi.advanceTimersByTime(1000)
    expect([sent, leaseAsked]).toEqual([[], 0])
  })

  test.each(['lease-lost', 'robot-stopped'] as const)('%s ends the hold in silence, and having it back moves nothing', (reason) => {
    const session = openSession()
    press('KeyW')
    sent = []
    session.setPermit('refused', reason)
    session.setPermit('granted', reason)
    press('KeyW', { repeat: true })
    vi.advanceTimersByTime(1000)
    expect(sent).toEqual([])
    expect(session.status.tone).toBe(reason === 'lease-lost' ? 'stopped' : 'idle')
  })

  test.each(['granted', 'free'] as const)('what is said of a stop goes when it is cleared (%s)', (permit) => {
    const session = openSession()
    press('KeyW')
    press('Escape')
    expect(session.status.text).toBe('Stopped by Escape')
    session.setPermit('refused', 'robot-stopped')
    expect(session.status.text).toBe('Stopped by Escape')
    session.setPermit(permit, 'lease-lost')
    expect(session.status.text).toBe('Ready')
  })

  test('it goes too where somebody else has control after the stop', () => {
    const session = openSession()
    press('KeyW')
    session.setPermit('refused', 'robot-stopped')
    session.setPermit('refused', 'lease-lost')
    session.setPermit('free', 'lease-lost')
    expect(session.status.text).toBe('Ready')
  })
})

describe('a stop of the robot', () => {
  test('ends the hold of every pad of that robot with zeros', () => {
    openSession()
    press('KeyW')
    restAllPads('another')
    expect(sent.at(-1)).not.toEqual(ZERO_TWIST)
    restAllPads('r')
    expect(sent.at(-1)).toEqual(ZERO_TWIST)
  })

  test('sends zeros also where nobody held: a robot that knows no stop may be moving all the same', () => {
    openSession()
    restAllPads('r')
    vi.advanceTimersByTime(2000)
    expect(sent).toEqual(Array.from({ length: ZEROS_AFTER_STOP }, () => ZERO_TWIST))
  })

  test('sends none where somebody else commands', () => {
    openSession().setPermit('refused', 'lease-lost')
    restAllPads('r')
    expect(sent).toEqual([])
  })

  test('Escape lets go, wherever the focus is', () => {
    openSession()
    press('KeyW')
    press('Escape', {}, document.body.appendChild(document.createElement('input')))
    expect(sent.at(-1)).toEqual(ZERO_TWIST)
  })
})

describe('a gamepad', () => {
  const LB = 4
  const B = 1

  function driving() {
    const session = openSession()
    const pad = pads.plugIn()
    vi.advanceTimersByTime(2 * TICK_MS)
    pad.axes[1] = -1
    setPressed(pad, LB, true)
    vi.advanceTimersByTime(2 * TICK_MS)
    return { session, pad }
  }

  test('drives while its dead-man button is held', () => {
    const { pad } = driving()
    expect(sent.at(-1)?.linear.x).toBe(1)
    setPressed(pad, LB, false)
    vi.advanceTimersByTime(TICK_MS)
    expect(sent.at(-1)).toEqual(ZERO_TWIST)
  })

  test('drives the pad it belongs to and no other: a touch of another pad ends it here, and it starts nothing there', () => {
    const { pad } = driving()
    const second = openSession()
    second.moveStick({ forward: 0, left: 1 })
    vi.advanceTimersByTime(2 * TICK_MS)
    second.stop('released')
    sent.length = 0
    vi.advanceTimersByTime(3000)
    expect(sent.filter((twist) => twist.linear.x !== 0)).toEqual([])
    setPressed(pad, LB, false)
    vi.advanceTimersByTime(TICK_MS)
    setPressed(pad, LB, true)
    vi.advanceTimersByTime(2 * TICK_MS)
    expect(sent.at(-1)?.linear.x).toBe(1)
    expect(second.get().gamepad).not.toBeNull()
  })

  test('does nothing without it', () => {
    openSession()
    pads.plugIn().axes[1] = -1
    vi.advanceTimersByTime(1000)
    expect(sent).toEqual([])
  })

  test('unplugged, it stops at once: no tick is waited for', () => {
    const { session, pad } = driving()
    pads.unplug(pad)
    expect(sent.at(-1)).toEqual(ZERO_TWIST)
    expect(session.status.text).toContain('unplugged')
  })

  test.each<[string, () => void]>([
    ['a lost focus', () => window.dispatchEvent(new Event('blur'))],
    ['a hidden page', hide],
    ['a stop of the robot', () => restAllPads('r')],
  ])('%s stops it until its button was released', (_name, end) => {
    const { pad } = driving()
    end()
    vi.advanceTimersByTime(2000)
    expect(sent.at(-1)).toEqual(ZERO_TWIST)
    setPressed(pad, LB, false)
    vi.advanceTimersByTime(TICK_MS)
    setPressed(pad, LB, true)
    vi.advanceTimersByTime(2 * TICK_MS)
    expect(sent.at(-1)?.linear.x).toBe(1)
  })

  test('held while somebody else commands, it does not start when control comes', () => {
    const session = openSession()
    session.setPermit('refused', 'lease-lost')
    const pad = pads.plugIn()
    vi.advanceTimersByTime(2 * TICK_MS)
    pad.axes[1] = -1
    setPressed(pad, LB, true)
    vi.advanceTimersByTime(2 * TICK_MS)
    session.setPermit('granted', 'lease-lost')
    vi.advanceTimersByTime(1000)
    expect(sent).toEqual([])
  })

  test('its stop button stops the robot, also for those who may not drive', () => {
    openSession().setPermit('refused', 'lease-lost')
    const pad = pads.plugIn()
    vi.advanceTimersByTime(2 * TICK_MS)
    setPressed(pad, B, true)
    vi.advanceTimersByTime(1000)
    expect(stopsAsked).toBe(1)
  })

  test('one that nobody has looked at does not drive', () => {
    openSession()
    const pad = pads.plugIn({ id: 'Joystick', mapping: '' })
    vi.advanceTimersByTime(2 * TICK_MS)
    pad.axes[1] = -1
    setPressed(pad, 0, true)
    vi.advanceTimersByTime(1000)
    expect(sent).toEqual([])
  })

  test('nothing drives while its mapping is edited', () => {
    const { pad } = driving()
    const end = gamepads.beginEditing()
    vi.advanceTimersByTime(TICK_MS)
    expect(sent.at(-1)).toEqual(ZERO_TWIST)
    end()
    vi.advanceTimersByTime(2000)
    expect(sent.at(-1)).toEqual(ZERO_TWIST)
    expect(pad.buttons[LB]?.pressed).toBe(true)
  })
})
