import { MantineProvider } from '@mantine/core'
import { MosaicError, Value, type MosaicClient } from '@mosaic/client'
import { MosaicProvider } from '@mosaic/react'
import { act, cleanup, fireEvent, render, screen } from '@testing-library/react'
import { afterEach, beforeEach, expect, test, vi } from 'vitest'
import { MemoryRouter } from 'react-router-dom'
import { App } from './App'
import { RETRY_MS } from './session/ServerAwayPage'

class FakeClient {
  readonly session = new Value<{ user: { email: string } } | null>(null)
  readonly sessionError = new Value<MosaicError | null>(null)
  readonly robots = new Value([{ id: 'r', name: 'kitchen-bot', description: '', isOnline: true, status: 2 }])
  readonly server = new Value('online')
  readonly api = { server: () => Promise.resolve({}) }
  remembersSession = true
  isServerAway = true
  restore = vi.fn(() => {
    if (this.isServerAway) this.sessionError.set(new MosaicError('signal.unreachable'))
    else this.session.set({ user: { email: 'ada@example.org' } })
    return Promise.resolve()
  })
  refreshRobots = () => Promise.resolve()
  logout = () => {
    this.remembersSession = false
    this.sessionError.set(null)
  }
}

let client: FakeClient

beforeEach(() => {
  vi.useFakeTimers()
  client = new FakeClient()
})
afterEach(() => {
  cleanup()
  vi.useRealTimers()
})

async function open() {
  render(
    <MantineProvider env="test">
      <MosaicProvider client={client as unknown as MosaicClient}>
        <MemoryRouter>
          <App code={null} />
        </MemoryRouter>
      </MosaicProvider>
    </MantineProvider>,
  )
  await settled()
}

const settled = (ms = 0) => act(() => vi.advanceTimersByTimeAsync(ms))

test('with a remembered session the page says that the server is away, and goes on by itself when it returns', async () => {
  await open()
  expect(screen.getByRole('status').textContent).toContain("can't be reached")
  expect(screen.queryByLabelText(/Email/)).toBeNull()
  await settled(RETRY_MS)
  expect(screen.getByRole('status').textContent).toContain('goes on by itself')
  client.isServerAway = false
  await settled(RETRY_MS)
  expect(screen.getByText('kitchen-bot')).toBeTruthy()
  const asked = client.restore.mock.calls.length
  await settled(10 * RETRY_MS)
  expect(client.restore).toHaveBeenCalledTimes(asked)
})

test('it asks at once when the network is back', async () => {
  await open()
  client.isServerAway = false
  fireEvent(window, new Event('online'))
  await settled()
  expect(screen.getByText('kitchen-bot')).toBeTruthy()
})

test('a session that the server ended meanwhile leads to the sign-in, which says so', async () => {
  await open()
  client.restore.mockImplementation(() => {
    client.remembersSession = false
    client.sessionError.set(new MosaicError('auth.expired'))
    return Promise.resolve()
  })
  await settled(RETRY_MS)
  expect(screen.getByLabelText(/Email/)).toBeTruthy()
  expect(screen.getByRole('alert').textContent).toContain('expired')
})

test('who does not want to wait signs out', async () => {
  await open()
  fireEvent.click(screen.getByRole('button', { name: 'Sign out' }))
  await settled()
  expect(screen.getByLabelText(/Email/)).toBeTruthy()
})

test('without a remembered session there is the sign-in at once', async () => {
  client.remembersSession = false
  await open()
  expect(screen.getByLabelText(/Email/)).toBeTruthy()
})
