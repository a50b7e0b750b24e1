import { nowMs } from '@mosaic/client'
import { act, cleanup, fireEvent, render, screen, within } from '@testing-library/react'
import userEvent from '@testing-library/user-event'
import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest'
import { ALICE, ALICES, FakeConnection, FREE, ME, MINE, PATROL, SAFE, SENDING, WithRobot } from '../../test/fakeRobot'
import { ControlFrame } from './ControlFrame'
import { ControlNews } from './ControlNews'
import { HOLD_MS } from './HoldButton'
import { LeaseButtons } from './LeaseButton'
import { LeaseRequests } from './LeaseRequests'
import { Presence } from './Presence'
import { StopButton } from './StopButton'
import { StoppedBanner } from './StoppedBanner'

let connection: FakeConnection
const desk = () => connection.control

beforeEach(() => {
  connection = new FakeConnection()
})

afterEach(() => {
  cleanup()
  vi.useRealTimers()
})

function show(node: React.ReactNode): void {
  render(<WithRobot connection={connection}>{node}</WithRobot>)
}

describe('the stop button', () => {
  const button = () => screen.getByRole('button', { name: /stop the robot/i })

  test('stops at the touch, not at its end', () => {
    show(<StopButton robotId="r" />)
    fireEvent.pointerDown(button(), { button: 0 })
    expect(desk().said).toEqual([['stop', '']])
    fireEvent.click(button(), { detail: 1 })
    expect(desk().said).toHaveLength(1)
  })

  test('stops from the keyboard and for assistive technology', async () => {
    show(<StopButton robotId="r" />)
    button().focus()
    await userEvent.keyboard('{Enter}')
    expect(desk().said).toEqual([['stop', '']])
  })

  test('its key works in a field, and one Escape alone does not', () => {
    show(
      <>
        <StopButton robotId="r" />
        <input aria-label="field" onKeyDown={(event) => event.stopPropagation()} />
      </>,
    )
    const field = screen.getByLabelText('field')
    fireEvent.keyDown(field, { code: 'Escape' })
    expect(desk().said).toEqual([])
    fireEvent.keyDown(field, { code: 'Escape' })
    expect(desk().said).toEqual([['stop', '']])
  })

  test('an observer may stop', () => {
    desk().me.set({ ...ME, role: 'observer' })
    show(<StopButton robotId="r" />)
    fireEvent.pointerDown(button(), { button: 0 })
    expect(desk().said).toHaveLength(1)
  })

  test('an observer whose right was taken reads by whom, and stops nothing', () => {
    desk().me.set({ ...ME, role: 'observer', mayStop: false, stopRightBy: 'Boss' })
    show(<StopButton robotId="r" />)
    expect(button().textContent).toContain('No stop')
    expect(button().getAttribute('aria-disabled')).toBe('true')
    expect(button().getAttribute('aria-description')).toBe('Boss took from you the right to stop this robot. Tell a supervisor what you see.')
    fireEvent.pointerDown(button(), { button: 0 })
    fireEvent.click(button(), { detail: 0 })
    fireEvent.keyDown(document.body, { code: 'Escape' })
    fireEvent.keyDown(document.body, { code: 'Escape' })
    expect(desk().said).toEqual([])
    act(() => desk().me.set({ ...ME, role: 'observer', stopRightBy: 'Boss' }))
    fireEvent.pointerDown(button(), { button: 0 })
    expect(desk().said).toEqual([['stop', '']])
  })

  test('says how far it is', () => {
    show(<StopButton robotId="r" />)
    act(() => desk().stopState.set({ isStopped: false, by: '', reason: '', mine: SENDING }))
    expect(button().textContent).toContain('Stopping…')
    act(() => desk().stopState.set({ isStopped: true, by: 'Mia', reason: '', mine: SAFE }))
    expect(button().textContent).toContain('Stopped')
  })
})

describe('the banner of a stopped robot', () => {
  const stopped = (mine: typeof SAFE | null = null) => act(() => desk().stopState.set({ isStopped: true, by: 'Bob', reason: 'child on the floor', mine }))

  test('is not there while nothing is stopped', () => {
    show(<StoppedBanner robotId="r" />)
    expect(screen.queryByTestId('stopped-banner')).toBeNull()
  })

  test('says who, why, how quickly, and what it is not', () => {
    show(<StoppedBanner robotId="r" />)
    stopped(SAFE)
    const text = screen.getByTestId('stopped-banner').textContent
    expect(text).toContain('Stopped in 43 ms')
    expect(text).toContain('Stopped by Bob: “child on the floor”')
    expect(text).toContain('not a certified emergency stop')
  })

  test('says since when, once the clocks have been compared', () => {
    vi.useFakeTimers()
    desk().clocksCompared = false
    show(<StoppedBanner robotId="r" />)
    act(() => desk().stopState.set({ isStopped: true, by: 'Bob', reason: '', sinceUs: nowMs() * 1000, mine: null }))
    act(() => void vi.advanceTimersByTime(2000))
    expect(screen.getByTestId('stopped-banner').textContent).not.toContain('Since')
    desk().clocksCompared = true
    act(() => void vi.advanceTimersByTime(2000))
    expect(screen.getByTestId('stopped-banner').textContent).toMatch(/Since \d/)
    expect(screen.getByRole('alert').textContent).not.toContain('Since')
  })

  test('does not measure somebody else’s stop by mine', () => {
    show(<StoppedBanner robotId="r" />)
    stopped(SAFE)
    act(() => {
      desk().tell({ type: 'cleared' })
      desk().stopState.set({ isStopped: false, by: '', reason: '', mine: SAFE })
    })
    stopped(SAFE)
    expect(screen.getByRole('alert').textContent).not.toContain('43 ms')
  })

  test('is cleared by holding, not by a press', () => {
    vi.useFakeTimers()
    desk().setLease(MINE)
    show(<StoppedBanner robotId="r" />)
    stopped()
    const clear = screen.getByRole('button', { name: 'Hold to clear' })
    fireEvent.pointerDown(clear, { button: 0 })
    act(() => void vi.advanceTimersByTime(HOLD_MS / 2))
    fireEvent.pointerUp(clear)
    fireEvent.click(clear, { detail: 1 })
    act(() => void vi.advanceTimersByTime(2 * HOLD_MS))
    expect(desk().said).toEqual([])
    fireEvent.pointerDown(clear, { button: 0 })
    act(() => void vi.advanceTimersByTime(HOLD_MS))
    expect(desk().said).toEqual([['clear']])
  })

  test('is cleared by holding a key', () => {
    vi.useFakeTimers()
    desk().setLease(MINE)
    show(<StoppedBanner robotId="r" />)
    stopped()
    fireEvent.keyDown(screen.getByRole('button', { name: 'Hold to clear' }), { key: ' ' })
    act(() => void vi.advanceTimersByTime(HOLD_MS))
    expect(desk().said).toEqual([['clear']])
  })

  test('is cleared by two presses where nobody can hold: a screen reader only clicks', () => {
    desk().setLease(MINE)
    show(<StoppedBanner robotId="r" />)
    stopped()
    fireEvent.click(screen.getByRole('button', { name: 'Hold to clear' }), { detail: 0 })
    expect(desk().said).toEqual([])
    fireEvent.click(screen.getByRole('button', { name: 'Press again to confirm' }), { detail: 0 })
    expect(desk().said).toEqual([['clear']])
  })

  test('says why the robot did not take the clearing', async () => {
    desk().setLease(MINE)
    desk().clearAnswer = { isCleared: false, code: 'lease.forbidden' }
    show(<StoppedBanner robotId="r" />)
    stopped()
    fireEvent.click(screen.getByRole('button', { name: 'Hold to clear' }), { detail: 0 })
    fireEvent.click(screen.getByRole('button', { name: 'Press again to confirm' }), { detail: 0 })
    expect(await screen.findByText('This role may not command.')).toBeTruthy()
  })

  test('tells who may clear it where this page may not', () => {
    desk().setLease(ALICES)
    show(<StoppedBanner robotId="r" />)
    stopped()
    expect(screen.queryByRole('button', { name: 'Hold to clear' })).toBeNull()
    expect(screen.getByText(/Alice, who has control, or a supervisor/)).toBeTruthy()
  })

  test('a stop that nobody confirmed is not passed over', async () => {
    show(<StoppedBanner robotId="r" />)
    act(() => desk().stopState.set({ isStopped: false, by: '', reason: '', mine: { ...SENDING, phase: 'unconfirmed' } }))
    expect(screen.getByRole('alert').textContent).toContain('did not confirm')
    await userEvent.click(screen.getByRole('button', { name: 'Hide this' }))
    expect(screen.queryByRole('alert')).toBeNull()
  })
})

describe('of a page that is not connected', () => {
  test.each([
    ['sending', 'It leaves as soon as the page is connected'],
    ['unconfirmed', 'Stop it at the robot'],
  ] as const)('a stop (%s) says that nothing was sent', (phase, whatNow) => {
    show(<StoppedBanner robotId="r" />)
    act(() => desk().stopState.set({ isStopped: false, by: '', reason: '', mine: { ...SENDING, copies: 0, phase } }))
    expect(screen.getByRole('alert').textContent).toContain('this page is not connected, so nothing was sent')
    expect(screen.getByRole('alert').textContent).toContain(whatNow)
    expect(screen.getByRole('alert').textContent).not.toContain('did not confirm')
  })
})

describe('of a robot that knows no stop', () => {
  const report = (zeros: { sent: string[]; unsent: string[] }) => {
    desk().availability.set('unavailable')
    show(<StoppedBanner robotId="r" />)
    act(() => desk().stopState.set({ isStopped: false, by: '', reason: '', mine: { ...SENDING, phase: 'unavailable', zeros } }))
    return screen.getByTestId('stopped-banner')
  }

  test('zeros that left are said, and nothing more', () => {
    const banner = report({ sent: ['cmd_vel'], unsent: [] })
    expect(banner.dataset['tone']).toBe('zeros')
    expect(screen.getByRole('alert').textContent).toContain('zeros were sent to ‘cmd_vel’')
    expect(screen.getByRole('alert').textContent).toContain('nothing here can confirm that it stands')
  })

  test('zeros that did not leave are never said to have', () => {
    const banner = report({ sent: [], unsent: [] })
    expect(banner.dataset['tone']).toBe('stopped')
    expect(banner.textContent).toContain('nothing was sent')
    expect(banner.textContent).toContain('Stop it at the robot')
    expect(banner.textContent).not.toContain('travels over the network')
  })

  test('the button says what it can do, and what it can’t', () => {
    desk().availability.set('unavailable')
    show(<StopButton robotId="r" />)
    const button = screen.getByRole('button', { name: /stop the robot/i })
    expect(button.textContent).toContain('No stop')
    expect(button.getAttribute('aria-description')).toContain('can’t stop it')
    act(() => desk().restable.set(['cmd_vel']))
    expect(button.textContent).toContain('Stop')
    expect(button.getAttribute('aria-description')).toContain('its drive (cmd_vel) is sent zeros')
  })
})

describe('the lease button', () => {
  test('takes a free lease, and gives it back', async () => {
    show(<LeaseButtons robotId="r" />)
    await userEvent.click(screen.getByRole('button', { name: 'Take control' }))
    expect(desk().said).toEqual([['request', 'motion']])
    act(() => desk().setLease(MINE))
    await userEvent.click(screen.getByRole('button', { name: 'You have control' }))
    expect(desk().said.at(-1)).toEqual(['release', 'motion'])
  })

  test('asks whoever has control, with a reason', async () => {
    desk().setLease(ALICES)
    show(<LeaseButtons robotId="r" />)
    await userEvent.click(screen.getByRole('button', { name: 'Alice has control' }))
    const form = await screen.findByRole('form', { name: 'Ask for control' })
    await userEvent.type(within(form).getByLabelText('Reason'), 'the lift comes')
    await userEvent.click(within(form).getByRole('button', { name: 'Ask Alice' }))
    expect(desk().said).toEqual([['request', 'motion', { reason: 'the lift comes', force: false }]])
  })

  test('only a supervisor may take over, and must say why', async () => {
    desk().setLease(ALICES)
    desk().me.set({ ...ME, role: 'supervisor' })
    show(<LeaseButtons robotId="r" />)
    await userEvent.click(screen.getByRole('button', { name: 'Alice has control' }))
    const force = await screen.findByRole('button', { name: 'Take over now' })
    await userEvent.click(force)
    expect(desk().said).toEqual([])
    expect(screen.getByText('Say why you take over.')).toBeTruthy()
    await userEvent.type(screen.getByLabelText('Reason'), 'smoke')
    await userEvent.click(force)
    expect(desk().said).toEqual([['request', 'motion', { reason: 'smoke', force: true }]])
  })

  test('an operator is not offered to take over', async () => {
    desk().setLease(ALICES)
    show(<LeaseButtons robotId="r" />)
    await userEvent.click(screen.getByRole('button', { name: 'Alice has control' }))
    await screen.findByRole('form', { name: 'Ask for control' })
    expect(screen.queryByRole('button', { name: 'Take over now' })).toBeNull()
  })

  test('a waiting request can be withdrawn', async () => {
    desk().setLease({ ...ALICES, request: { phase: 'queued', place: 1, code: 'lease.queued' } })
    show(<LeaseButtons robotId="r" />)
    await userEvent.click(screen.getByRole('button', { name: 'Waiting for Alice' }))
    expect(desk().said).toEqual([['release', 'motion']])
  })

  test('there is one per resource, and none for an original robot', () => {
    desk().setLease({ ...FREE, resource: 'arm' })
    show(<LeaseButtons robotId="r" />)
    expect(screen.getByRole('button', { name: 'Take control of arm' })).toBeTruthy()
    act(() => desk().availability.set('unavailable'))
    expect(screen.queryAllByRole('button')).toEqual([])
  })
})

describe('the lease button of a robot whose connectors all need another lease', () => {
  const ARM = { label: 'arm', type: 'x', kind: 'data', dataType: 'json-u2r', direction: 'to-robot', channels: [], delivery: 'latest' } as const
  const announce = (...resources: string[]) =>
    connection.catalogue.set({
      hash: '',
      entries: resources.map((resource) => ({ ...ARM, label: resource, safety: { requires_lease: true, resource } })),
    })

  test('is of that one alone', () => {
    desk().setLease({ ...FREE, resource: 'arm' })
    announce('arm')
    show(<LeaseButtons robotId="r" />)
    expect(screen.getAllByRole('button').map(({ textContent }) => textContent)).toEqual(['Take control of arm'])
    act(() => announce('arm', 'motion'))
    expect(screen.getAllByRole('button')).toHaveLength(2)
  })

  test('is of motion too while somebody has it', () => {
    desk().setLease({ ...FREE, resource: 'arm' })
    desk().setLease(ALICES)
    announce('arm')
    show(<LeaseButtons robotId="r" />)
    expect(screen.getByRole('button', { name: 'Alice has control' })).toBeTruthy()
  })
})

describe('requests', () => {
  const asking = { ...MINE, queue: [{ peerId: 'bob', name: 'Bob', reason: 'my turn', isPerson: true }] }

  test('are shown to the holder, who answers', async () => {
    desk().setLease(asking)
    show(<LeaseRequests robotId="r" />)
    const card = screen.getByRole('region', { name: 'Bob asks for control' })
    expect(card.textContent).toContain('my turn')
    await userEvent.click(within(card).getByRole('button', { name: 'Not now' }))
    await userEvent.click(within(card).getByRole('button', { name: 'Hand over' }))
    expect(desk().said).toEqual([
      ['answer', 'motion', 'bob', false, undefined],
      ['answer', 'motion', 'bob', true, undefined],
    ])
  })

  test('take no focus away from whoever drives', () => {
    show(
      <>
        <button>driving</button>
        <LeaseRequests robotId="r" />
      </>,
    )
    screen.getByText('driving').focus()
    act(() => desk().setLease(asking))
    expect(document.activeElement?.textContent).toBe('driving')
  })

  test('are nobody else’s business', () => {
    desk().setLease({ ...ALICES, queue: asking.queue })
    show(<LeaseRequests robotId="r" />)
    expect(screen.queryByRole('region')).toBeNull()
  })
})

describe('news', () => {
  test('of a take-over stays, with the reason, until control is back', () => {
    show(<ControlNews robotId="r" />)
    act(() => desk().tell({ type: 'lost', resource: 'motion', code: 'lease.taken_over', message: 'smoke' }))
    expect(screen.getByTestId('control-news').textContent).toContain('A supervisor took the lease over. “smoke”')
    act(() => desk().tell({ type: 'granted', resource: 'motion' }))
    expect(screen.getByTestId('control-news').textContent).toBe('')
  })

  test('of a grant after a wait is said', () => {
    show(<ControlNews robotId="r" />)
    act(() => desk().tell({ type: 'queued', resource: 'motion', code: 'lease.queued' }))
    act(() => desk().tell({ type: 'granted', resource: 'motion' }))
    expect(screen.getByTestId('control-news').textContent).toContain('You have control.')
  })

  test.each<[boolean, boolean, string]>([
    [true, false, 'You may no longer stop this robot. Boss took from you the right'],
    [true, true, 'You may stop this robot again. Boss gave the right back.'],
    [false, false, 'Wanda may no longer stop this robot. Boss took the right to stop.'],
    [false, true, 'Wanda may stop this robot again. Boss gave the right to stop back.'],
  ])('of a right to stop that changed is said by whom (mine: %s, given back: %s)', (isMe, mayStop, text) => {
    show(<ControlNews robotId="r" />)
    const of = { ...ALICE, name: 'Wanda', role: 'observer' as const, isMe, mayStop, stopRightBy: 'Boss' }
    act(() => desk().tell({ type: 'stopRight', of, mayStop, by: 'Boss' }))
    expect(screen.getByTestId('control-news').textContent).toContain(text)
  })
})

test('who is here is a sentence for those who can’t see the chips', () => {
  desk().peers.set([ME, ALICE, PATROL])
  desk().setLease(ALICES)
  show(<Presence robotId="r" />)
  expect(screen.getByRole('button', { name: 'Who is here. Driving: Alice. Watching: You, patrol.' })).toBeTruthy()
})

test('Escape closes the list of who is here wherever the focus is, and twice it stops the robot all the same', async () => {
  desk().peers.set([ME, ALICE])
  show(
    <>
      <StopButton robotId="r" />
      <Presence robotId="r" />
      <input aria-label="field" onKeyDown={(event) => event.stopPropagation()} />
    </>,
  )
  await userEvent.click(screen.getByTestId('presence'))
  expect(screen.getByRole('dialog').textContent).toContain('Alice')
  fireEvent.keyDown(screen.getByLabelText('field'), { code: 'Escape' })
  expect(screen.queryByRole('dialog')).toBeNull()
  expect(desk().said).toEqual([])
  fireEvent.keyDown(screen.getByLabelText('field'), { code: 'Escape' })
  expect(desk().said).toEqual([['stop', '']])
})

test('a second click closes the list of who is here', async () => {
  desk().peers.set([ME, ALICE])
  show(<Presence robotId="r" />)
  await userEvent.click(screen.getByTestId('presence'))
  await userEvent.click(screen.getByTestId('presence'))
  expect(screen.queryByRole('dialog')).toBeNull()
})

test('two accounts of one name are told apart; two tabs of one account are not', () => {
  const tab = { ...ALICE, account: '7d1c2f6e-0b52' }
  desk().peers.set([{ ...ME, name: 'Alice' }, tab, { ...tab, peerId: 'tab' }])
  show(<Presence robotId="r" />)
  const here = () => screen.getByTestId('presence').textContent
  expect(here()).toContain('Watching: You, Alice, Alice.')
  act(() => desk().peers.set([tab, { ...tab, peerId: 'other', account: '11aa22bb-99' }]))
  expect(here()).toContain('Alice (11aa22bb)')
  expect(here()).toContain('Alice (7d1c2f6e)')
})

test('a supervisor takes the right to stop from an observer, and gives it back; nobody else can', async () => {
  const wanda = { ...ALICE, peerId: 'wanda', name: 'Wanda', role: 'observer' as const }
  const boss = { ...ME, role: 'supervisor' as const }
  desk().peers.set([boss, wanda, PATROL])
  desk().me.set(boss)
  show(<Presence robotId="r" />)
  await userEvent.click(screen.getByTestId('presence'))
  await userEvent.click(screen.getByText('Take the right to stop'))
  expect(desk().said).toEqual([['right', 'wanda', false]])
  act(() => desk().peers.set([boss, { ...wanda, mayStop: false, stopRightBy: 'Mia' }, PATROL]))
  expect(screen.getByText(/may not stop: Mia took that right/)).toBeTruthy()
  await userEvent.click(screen.getByText('Let stop again'))
  expect(desk().said).toEqual([['right', 'wanda', false], ['right', 'wanda', true]])
  act(() => desk().me.set(ME))
  expect(screen.queryByText('Let stop again')).toBeNull()
})

describe('the frame around the page', () => {
  const tone = () => screen.getByTestId('control-frame').dataset['tone']

  test('shows how the speed is limited, and why', () => {
    show(<ControlFrame robotId="r" />)
    act(() => desk().limits.set({ cmd_vel: { label: 'cmd_vel', factor: 0.95, causes: [{ cause: 'rtt', value: 180, factor: 0.95 }] } }))
    expect(tone()).toBe('none')
    act(() => desk().limits.set({ cmd_vel: { label: 'cmd_vel', factor: 0.25, causes: [{ cause: 'rtt', value: 640, factor: 0.25 }] } }))
    expect(tone()).toBe('slowed')
    expect(screen.getByRole('status').textContent).toContain('Slowed to 25 %')
    act(() => desk().limits.set({ cmd_vel: { label: 'cmd_vel', factor: 0, causes: [{ cause: 'picture', value: 1500, factor: 0 }] } }))
    expect(tone()).toBe('held')
  })

  test('a stop counts more than a limit', () => {
    show(<ControlFrame robotId="r" />)
    act(() => desk().limits.set({ cmd_vel: { label: 'cmd_vel', factor: 0.5, causes: [] } }))
    act(() => desk().stopState.set({ isStopped: true, by: '', reason: '', mine: null }))
    expect(tone()).toBe('stopped')
  })
})
