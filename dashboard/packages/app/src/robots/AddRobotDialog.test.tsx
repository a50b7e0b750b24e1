import { MantineProvider } from '@mantine/core'
import type { MosaicClient } from '@mosaic/client'
import { MosaicProvider } from '@mosaic/react'
import { cleanup, render, screen } from '@testing-library/react'
import userEvent from '@testing-library/user-event'
import { afterEach, expect, test, vi } from 'vitest'
import AddRobotDialog from './AddRobotDialog'

afterEach(cleanup)

function shown() {
  const onClose = vi.fn()
  const client = {
    api: { createRobot: () => Promise.resolve({ id: 'r1' }), newRobotToken: () => Promise.resolve('the-token') },
    refreshRobots: () => Promise.resolve(),
  }
  render(
    <MantineProvider env="test">
      <MosaicProvider client={client as unknown as MosaicClient}>
        <AddRobotDialog onClose={onClose} />
      </MosaicProvider>
    </MantineProvider>,
  )
  return onClose
}

test('the token is shown until "Done": neither Escape nor a click beside the dialog takes it away', async () => {
  const onClose = shown()
  const user = userEvent.setup()
  await user.type(screen.getByLabelText(/Name/), 'kitchen-bot')
  await user.click(screen.getByRole('button', { name: 'Add robot' }))
  expect((await screen.findByText(/the-token/)).textContent).toContain('r1')
  await user.keyboard('{Escape}')
  const overlay = document.querySelector('.mantine-Modal-inner')
  if (overlay !== null) await user.click(overlay)
  expect(screen.queryByRole('button', { name: 'Close' })).toBeNull()
  expect(onClose).not.toHaveBeenCalled()
  await user.click(screen.getByRole('button', { name: 'Done' }))
  expect(onClose).toHaveBeenCalledOnce()
})

test('before there is a token Escape closes the dialog', async () => {
  const onClose = shown()
  await userEvent.setup().keyboard('{Escape}')
  expect(onClose).toHaveBeenCalledOnce()
})
