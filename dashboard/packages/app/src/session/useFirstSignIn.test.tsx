import { MantineProvider } from '@mantine/core'
import { MosaicError, Value, type MosaicClient } from '@mosaic/client'
import { MosaicProvider } from '@mosaic/react'
import { cleanup, render, screen } from '@testing-library/react'
import userEvent from '@testing-library/user-event'
import { afterEach, beforeEach, expect, test, vi } from 'vitest'
import type { AddressCode } from './addressCodes'
import { ReplaceSession } from './ReplaceSession'
import { useFirstSignIn } from './useFirstSignIn'

class FakeClient {
  readonly session = new Value<{ user: { email: string } } | null>(null)
  remembered: string | null = 'ada@example.org'
  isServerAway = false
  get remembersSession() {
    return this.remembered !== null
  }
  restore = () => {
    if (this.remembered !== null && !this.isServerAway) this.session.set({ user: { email: this.remembered } })
    return Promise.resolve()
  }
  loginWithCode = vi.fn((_code: string) => {
    this.session.set({ user: { email: 'mallory@example.org' } })
    return Promise.resolve()
  })
  pair = vi.fn(() => Promise.resolve())
}

let client: FakeClient

beforeEach(() => {
  client = new FakeClient()
})
afterEach(cleanup)

function Page({ code }: { code: AddressCode }) {
  const { isBusy, failure, asks, answer } = useFirstSignIn(code)
  if (asks) return <ReplaceSession failure={failure} isBusy={isBusy} onAnswer={answer} />
  return isBusy ? null : <p>{client.session.get()?.user.email ?? 'nobody'}</p>
}

function open(kind: AddressCode['kind']) {
  const code = { kind, value: 'once' }
  render(
    <MantineProvider env="test">
      <MosaicProvider client={client as unknown as MosaicClient}>
        <Page code={code} />
      </MosaicProvider>
    </MantineProvider>,
  )
}

test('a link does not replace who is signed in without asking', async () => {
  open('code')
  await userEvent.click(await screen.findByRole('button', { name: 'Stay signed in' }))
  expect(screen.getByText('ada@example.org')).toBeTruthy()
  expect(client.loginWithCode).not.toHaveBeenCalled()
})

test('a link does not replace a session that could not be restored, because the server was away just then', async () => {
  client.isServerAway = true
  open('code')
  const stay = await screen.findByRole('button', { name: 'Stay signed in' })
  expect(client.loginWithCode).not.toHaveBeenCalled()
  client.isServerAway = false
  await userEvent.click(stay)
  expect(await screen.findByText('ada@example.org')).toBeTruthy()
  expect(client.loginWithCode).not.toHaveBeenCalled()
})

test('who is asked before the server could say who is signed in may take the link all the same', async () => {
  client.isServerAway = true
  open('code')
  await userEvent.click(await screen.findByRole('button', { name: 'Sign in with the link' }))
  expect(await screen.findByText('mallory@example.org')).toBeTruthy()
})

test('a device whose pairing could not be checked yet is paired no second time', async () => {
  client.isServerAway = true
  open('pair')
  expect(await screen.findByText('nobody')).toBeTruthy()
  expect(client.pair).not.toHaveBeenCalled()
})

test('who wants to signs in with the link', async () => {
  open('code')
  await userEvent.click(await screen.findByRole('button', { name: 'Sign in with the link' }))
  expect(await screen.findByText('mallory@example.org')).toBeTruthy()
})

test('a code that signs nobody in says so and leaves the session as it is', async () => {
  client.loginWithCode.mockRejectedValueOnce(new MosaicError('auth.failed', 'the code was used already', ''))
  open('code')
  await userEvent.click(await screen.findByRole('button', { name: 'Sign in with the link' }))
  expect((await screen.findByRole('alert')).textContent).toContain('used already')
  await userEvent.click(screen.getByRole('button', { name: 'Stay signed in' }))
  expect(screen.getByText('ada@example.org')).toBeTruthy()
})

test('where nobody is signed in, the link signs in at once', async () => {
  client.remembered = null
  open('code')
  expect(await screen.findByText('mallory@example.org')).toBeTruthy()
})

test('who is paired already is asked nothing, and paired no second time', async () => {
  open('pair')
  expect(await screen.findByText('ada@example.org')).toBeTruthy()
  expect(client.pair).not.toHaveBeenCalled()
})
