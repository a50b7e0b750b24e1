import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest'
import { TICK_MS, ZERO_TWIST, type Twist } from './driveControl'
import { intervalClock } from './driveClock'
import { DriveSession } from './DriveSession'

const LIMITS = { maxLinearMps: 1, maxAngularRadps: 2 }
let sent: Twist[]
let accepts: boolean
let sessions: DriveSession[]

beforeEach(() => {
  vi.useFakeTimers()
  sent = []
  accepts = true
  sessions = []
})

afterEach(() => {
  for (const session of sessions) session.dispose()
  document.body.replaceChildren()
  vi.useRealTimers()
})

function openSession(): DriveSession {
  const session = new DriveSession({
    limits: LIMITS,
    makeClock: intervalClock,
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
  vi.advanceTimersByTime(1000)
  expect(vi.getTimerCount()).toBe(0)
})

const STOPS: [string, (session: DriveSession) => void][] = [
  ['the key is released', () => release('KeyW')],
  ['the window loses the focus', () => window.dispatchEvent(new Event('blur'))],
  ['the page is hidden', hide],
  ['the page is left', () => window.dispatchEvent(new Event('pagehide'))],
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
    expect(sent.length - before).toBeLessThanOrEqual(5)
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
    makeClock: (onTick) => {
      tick = onTick
      return { start: () => {}, stop: () => {}, dispose: () => {} }
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
