import { MantineProvider } from '@mantine/core'
import { MosaicError, type MosaicClient } from '@mosaic/client'
import { MosaicProvider } from '@mosaic/react'
import { cleanup, render, screen } from '@testing-library/react'
import userEvent from '@testing-library/user-event'
import { afterEach, expect, test, vi } from 'vitest'
import NewTokenDialog from './NewTokenDialog'

afterEach(cleanup)

const ISSUE = { name: 'End the old token and make a new one' }

function shown(newRobotToken: () => Promise<string>) {
  const onClose = vi.fn()
  const client = { api: { newRobotToken } } as unknown as MosaicClient
  render(
    <MantineProvider env="test">
      <MosaicProvider client={client}>
        <NewTokenDialog robotId="r1" name="Robbie" onClose={onClose} />
      </MosaicProvider>
    </MantineProvider>,
  )
  return onClose
}

test('the old token stays until the question is answered', async () => {
  const issue = vi.fn(() => Promise.resolve('new-token'))
  const onClose = shown(issue)
  await userEvent.click(screen.getByRole('button', { name: 'Cancel' }))
  expect(issue).not.toHaveBeenCalled()
  expect(onClose).toHaveBeenCalledOnce()
})

test('the new token is shown in a whole file, until "Done"', async () => {
  const onClose = shown(() => Promise.resolve('new-token'))
  const user = userEvent.setup()
  await user.click(screen.getByRole('button', ISSUE))
  expect((await screen.findByText(/new-token/)).textContent).toContain('robot_id: r1')
  await user.keyboard('{Escape}')
  expect(onClose).not.toHaveBeenCalled()
  await user.click(screen.getByRole('button', { name: 'Done' }))
  expect(onClose).toHaveBeenCalledOnce()
})

test('while the new token is being made nothing closes the dialog: the old one has ended already', async () => {
  let made = (_token: string) => {}
  const onClose = shown(() => new Promise((resolve) => (made = resolve)))
  const user = userEvent.setup()
  await user.click(screen.getByRole('button', ISSUE))
  await user.keyboard('{Escape}')
  await user.click(document.querySelector('.mantine-Modal-overlay') ?? document.body)
  await user.click(screen.getByRole('button', { name: 'Cancel' }))
  expect(screen.queryByRole('button', { name: '' })).toBeNull()
  expect(onClose).not.toHaveBeenCalled()
  made('new-token')
  expect(await screen.findByText(/new-token/)).toBeTruthy()
})

test('a refusal is said, and the question can be answered again', async () => {
  shown(() => Promise.reject(new MosaicError('auth.forbidden', 'this robot needs no token', 'Change how it signs in.')))
  await userEvent.click(screen.getByRole('button', ISSUE))
  expect((await screen.findByRole('alert')).textContent).toContain('this robot needs no token')
  expect(screen.getByRole('button', ISSUE)).toBeTruthy()
})
