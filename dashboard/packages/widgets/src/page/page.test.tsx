import { MosaicError, Value, type ConnectionState, type MosaicClient, type RobotSummary } from '@mosaic/client'
import { act, cleanup, render, screen } from '@testing-library/react'
import userEvent from '@testing-library/user-event'
import { StrictMode } from 'react'
import { afterEach, beforeEach, expect, test, vi } from 'vitest'
import { FakeConnection, WithRobot } from '../../test/fakeRobot'
import { MosaicPage } from './MosaicPage'
import { RobotChoice } from './RobotChoice'

class Connection extends FakeConnection {
  readonly connect = vi.fn()
  readonly disconnect = vi.fn()
}

const robot = (id: string, isOnline = true) => ({ id, name: id.toUpperCase(), isOnline }) as RobotSummary

let connections: Record<string, Connection>
let robots: Value<readonly RobotSummary[]>

beforeEach(() => {
  connections = { a: new Connection(), b: new Connection() }
  robots = new Value<readonly RobotSummary[]>([])
})

afterEach(cleanup)

function choice() {
  const client = { robots, connection: (id: string) => connections[id] }
  return (
    <WithRobot connection={new FakeConnection()} client={client}>
      <RobotChoice>{(robotId) => <p>shown: {robotId}</p>}</RobotChoice>
    </WithRobot>
  )
}

test('an only robot is chosen by itself, and let go of with the page', () => {
  robots.set([robot('a')])
  const page = render(choice())
  expect(screen.getByText('shown: a')).toBeDefined()
  expect(connections['a']?.connect).toHaveBeenCalled()
  expect(connections['a']?.disconnect).not.toHaveBeenCalled()
  page.unmount()
  expect(connections['a']?.disconnect).toHaveBeenCalledTimes(1)
})

test('of several one is chosen, which ends the connection to the one before', async () => {
  robots.set([robot('a'), robot('b', false)])
  render(choice())
  expect(screen.queryByText(/^shown/)).toBeNull()
  const user = userEvent.setup()
  await user.selectOptions(screen.getByLabelText('Robot'), 'a')
  expect(screen.getByText('shown: a')).toBeDefined()
  await user.selectOptions(screen.getByLabelText('Robot'), 'B (offline)')
  expect(screen.getByText('shown: b')).toBeDefined()
  expect(connections['a']?.disconnect).toHaveBeenCalledTimes(1)
  expect(connections['b']?.connect).toHaveBeenCalledTimes(1)
  act(() => robots.set([robot('a'), robot('b')]))
  expect(connections['b']?.connect, 'it came back').toHaveBeenCalledTimes(2)
})

test('a robot can be stopped whatever is shown of it, and why it is away is said', async () => {
  robots.set([robot('a')])
  render(choice())
  await userEvent.setup().click(screen.getByRole('button', { name: /^Stop/ }))
  expect(connections['a']?.control.said).toEqual([['stop', '']])
  const lost: ConnectionState = { phase: 'reconnecting', roundTripMs: null, code: 'peer.lost', message: 'The cable is gone.' }
  act(() => connections['a']?.state.set(lost))
  expect(screen.getByText(/^reconnecting: The cable is gone/)).toBeDefined()
})

test('where there is no robot, that is said', () => {
  render(choice())
  expect(screen.getByText('There is no robot yet')).toBeDefined()
})

function page(client: object) {
  const whole = { sessionError: new Value<MosaicError | null>(null), restoring: new Value(false), ...client }
  render(
    <StrictMode>
      <MosaicPage client={whole as unknown as MosaicClient}>
        <p>inside</p>
      </MosaicPage>
    </StrictMode>,
  )
}

test('a page asks who is there, once, and shows nothing before that is known', () => {
  const restoring = new Value(true)
  const session = new Value<object | null>(null)
  const restore = vi.fn(() => Promise.resolve())
  page({ restoring, session, restore })
  expect(restore).toHaveBeenCalledTimes(1)
  expect(screen.queryByRole('form')).toBeNull()
  act(() => {
    session.set({ token: 't', user: {} })
    restoring.set(false)
  })
  expect(screen.getByText('inside')).toBeDefined()
})

test('nobody is there: a sign-in, which says why it failed, and then the page', async () => {
  const session = new Value<object | null>(null)
  const login = vi.fn().mockRejectedValueOnce(new MosaicError('auth.failed'))
  page({ session, login, restore: () => Promise.resolve() })
  expect(screen.queryByText('inside')).toBeNull()
  const user = userEvent.setup()
  await user.type(screen.getByLabelText(/Email/), ' me@example.org')
  await user.type(screen.getByLabelText(/Password/, { selector: 'input' }), 'secret')
  await user.click(screen.getByRole('button', { name: 'Sign in' }))
  expect((await screen.findByRole('alert')).textContent).toContain('Check the email and the password')
  login.mockImplementation(() => {
    session.set({ token: 't', user: {} })
    return Promise.resolve()
  })
  await user.click(screen.getByRole('button', { name: 'Sign in' }))
  expect(login).toHaveBeenLastCalledWith('me@example.org', 'secret')
  expect(screen.getByText('inside')).toBeDefined()
})

test('whoever guessed too often is told what the server says to do, not to check the password', async () => {
  const cure = 'Wait that long; whoever forgot the password asks an administrator of the server for a new one.'
  const tooMany = new MosaicError('auth.failed', 'too many failed attempts; try again in 293 s', cure, 429)
  page({ session: new Value(null), login: () => Promise.reject(tooMany), restore: () => Promise.resolve() })
  const user = userEvent.setup()
  await user.type(screen.getByLabelText(/Email/), 'me@example.org')
  await user.type(screen.getByLabelText(/Password/, { selector: 'input' }), 'secret{Enter}')
  expect((await screen.findByRole('alert')).textContent).toBe(`too many failed attempts; try again in 293 s${cure}`)
})

test('why a session ended is said where a person signs in again', () => {
  const session = new Value<object | null>({ token: 't', user: {} })
  const sessionError = new Value<MosaicError | null>(null)
  page({ session, sessionError, restore: () => Promise.resolve() })
  act(() => {
    sessionError.set(new MosaicError('auth.expired'))
    session.set(null)
  })
  expect(screen.getByRole('alert').textContent).toContain('expired')
})
