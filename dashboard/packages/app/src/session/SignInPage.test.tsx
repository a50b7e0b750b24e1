import { MantineProvider } from '@mantine/core'
import { MosaicError, type MosaicClient } from '@mosaic/client'
import { MosaicProvider } from '@mosaic/react'
import { cleanup, render, screen } from '@testing-library/react'
import userEvent from '@testing-library/user-event'
import { afterEach, expect, test, vi } from 'vitest'
import { SignInPage } from './SignInPage'

afterEach(cleanup)

const EXPIRED = { code: 'auth.expired', message: 'The log-in has expired.', cure: 'Log in again.' }

function shown(client: object, firstFailure = null as null | typeof EXPIRED, server: object = {}) {
  const whole = { api: { server: () => Promise.resolve(server) }, ...client }
  render(
    <MantineProvider>
      <MosaicProvider client={whole as unknown as MosaicClient}>
        <SignInPage firstFailure={firstFailure} />
      </MosaicProvider>
    </MantineProvider>,
  )
}

async function submit(): Promise<void> {
  const user = userEvent.setup()
  await user.type(await screen.findByLabelText(/Email/), 'me@example.org')
  await user.type(screen.getByLabelText(/Password/, { selector: 'input' }), 'secret')
  await user.click(screen.getByRole('button', { name: 'Sign in' }))
}

test('email and password sign in', async () => {
  const login = vi.fn(() => Promise.resolve())
  shown({ login })
  await submit()
  expect(login).toHaveBeenCalledWith('me@example.org', 'secret')
})

test('a refusal is shown with its cure, and what was typed stays', async () => {
  shown({ login: () => Promise.reject(new MosaicError('auth.failed')) })
  await submit()
  const alert = await screen.findByRole('alert')
  expect(alert.textContent).toContain('refused')
  expect(alert.textContent).toContain('Check the email and the password')
  expect(screen.getByLabelText<HTMLInputElement>(/Email/).value).toBe('me@example.org')
})

test('a one-time code that did not work is said', async () => {
  shown({}, EXPIRED)
  expect((await screen.findByRole('alert')).textContent).toContain('expired')
})

test('an original server, which says nothing of itself, gets the usual sign-in', async () => {
  shown({ api: { server: () => Promise.reject(new MosaicError('signal.unreachable')) } })
  expect(await screen.findByLabelText(/Email/)).toBeDefined()
})

test('where the server belongs to a robot, its PIN pairs this device under a name', async () => {
  const pair = vi.fn(() => Promise.resolve())
  shown({ pair }, null, { pairsWith: 'Rover' })
  expect(await screen.findByRole('heading', { name: 'Pair with Rover' })).toBeDefined()
  const user = userEvent.setup()
  expect(screen.getByRole<HTMLButtonElement>('button', { name: 'Pair' }).disabled).toBe(true)
  await user.type(screen.getByLabelText(/^PIN/), '12345678')
  await user.clear(screen.getByLabelText(/Name of this device/))
  await user.type(screen.getByLabelText(/Name of this device/), "Ann's phone")
  await user.click(screen.getByRole('button', { name: 'Pair' }))
  expect(pair).toHaveBeenCalledWith({ pin: '1234 5678' }, "Ann's phone")
})

test('a wrong PIN is said, and the next one can be typed at once', async () => {
  shown({ pair: () => Promise.reject(new MosaicError('auth.pairing')) }, null, { pairsWith: 'Rover' })
  const user = userEvent.setup()
  await user.type(await screen.findByLabelText(/^PIN/), '12345678{Enter}')
  expect((await screen.findByRole('alert')).textContent).toContain('wrong')
  expect(screen.getByLabelText<HTMLInputElement>(/^PIN/).value).toBe('')
})

test('a code that was scanned too late is said beside the PIN', async () => {
  shown({}, EXPIRED, { pairsWith: 'Rover' })
  expect((await screen.findByRole('alert')).textContent).toContain('expired')
  expect(screen.getByLabelText(/^PIN/)).toBeDefined()
})

test('an account of the robot’s server may sign in with its password', async () => {
  shown({}, EXPIRED, { pairsWith: 'Rover' })
  await userEvent.setup().click(await screen.findByRole('button', { name: 'sign in with a password' }))
  expect(screen.getByLabelText(/Email/)).toBeDefined()
  expect(screen.queryByRole('alert')).toBeNull()
})
