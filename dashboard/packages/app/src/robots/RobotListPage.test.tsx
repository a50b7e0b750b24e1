import { MantineProvider } from '@mantine/core'
import { Value, type MosaicClient } from '@mosaic/client'
import { MosaicProvider } from '@mosaic/react'
import { cleanup, render, screen } from '@testing-library/react'
import userEvent from '@testing-library/user-event'
import { afterEach, expect, test, vi } from 'vitest'
import { MemoryRouter } from 'react-router-dom'
import { PageBoundary } from '../PageBoundary'
import { RobotListPage } from './RobotListPage'

vi.mock('./AddRobotDialog', () => {
  throw new Error('Failed to fetch dynamically imported module')
})

afterEach(cleanup)

test('where the dialog for another robot can’t be fetched it says so, and the list stays', async () => {
  vi.spyOn(console, 'error').mockReturnValue()
  const client = {
    session: new Value({ user: { email: 'ada@example.org', isOrganizationAdmin: true } }),
    robots: new Value([{ id: 'r', name: 'kitchen-bot', description: '', isOnline: true, status: 2 }]),
    server: new Value('online'),
    refreshRobots: () => Promise.resolve(),
  }
  render(
    <MantineProvider env="test">
      <MosaicProvider client={client as unknown as MosaicClient}>
        <MemoryRouter>
          <PageBoundary>
            <RobotListPage />
          </PageBoundary>
        </MemoryRouter>
      </MosaicProvider>
    </MantineProvider>,
  )
  await userEvent.click(screen.getByRole('button', { name: 'Add robot' }))
  expect((await screen.findByRole('alert')).textContent).toContain('could not be fetched')
  expect(screen.getByText('kitchen-bot')).toBeTruthy()
  await userEvent.click(screen.getByRole('button', { name: 'Hide this' }))
  expect(screen.queryByRole('alert')).toBeNull()
})
