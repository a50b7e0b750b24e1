import { MantineProvider } from '@mantine/core'
import { MosaicError, type MosaicClient } from '@mosaic/client'
import { MosaicProvider } from '@mosaic/react'
import { cleanup, render, screen } from '@testing-library/react'
import userEvent from '@testing-library/user-event'
import { afterEach, expect, test, vi } from 'vitest'
import { SignInPage } from './SignInPage'

afterEach(cleanup)

function shown(login: (email: string, password: string) => Promise<void>, firstFailure = null as null | { code: string; message: string; cure: string }) {
  render(
    <MantineProvider>
      <MosaicProvider client={{ login } as unknown as MosaicClient}>
        <SignInPage firstFailure={firstFailure} />
      </MosaicProvider>
    </MantineProvider>,
  )
}

async function submit(): Promise<void> {
  const user = userEvent.setup()
  await user.type(screen.getByLabelText(/Email/), 'me@example.org')
  await user.type(screen.getByLabelText(/Password/, { selector: 'input' }), 'secret')
  await user.click(screen.getByRole('button', { name: 'Sign in' }))
}

test('email and password sign in', async () => {
  const login = vi.fn(() => Promise.resolve())
  shown(login)
  await submit()
  expect(login).toHaveBeenCalledWith('me@example.org', 'secret')
})

test('a refusal is shown with its cure, and what was typed stays', async () => {
  shown(() => Promise.reject(new MosaicError('auth.failed')))
  await submit()
  const alert = await screen.findByRole('alert')
  expect(alert.textContent).toContain('refused')
  expect(screen.getByLabelText<HTMLInputElement>(/Email/).value).toBe('me@example.org')
})

test('a one-time code that did not work is said', () => {
  shown(() => Promise.resolve(), { code: 'auth.expired', message: 'The log-in has expired.', cure: 'Log in again.' })
  expect(screen.getByRole('alert').textContent).toContain('expired')
})
