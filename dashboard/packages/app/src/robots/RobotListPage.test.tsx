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

const fetchRobotPage = vi.fn(() => Promise.reject(new Error('the server is away')))

afterEach(() => {
  cleanup()
  fetchRobotPage.mockClear()
})

const ROBOT = { id: 'r', name: 'kitchen-bot', description: '', isOnline: true, status: 2 }

function showList(robots: readonly (typeof ROBOT)[]) {
  const client = {
    session: new Value({ user: { email: 'ada@example.org', isOrganizationAdmin: true } }),
    robots: new Value(robots),
    server: new Value('online'),
    refreshRobots: () => Promise.resolve(),
  }
  render(
    <MantineProvider env="test">
      <MosaicProvider client={client as unknown as MosaicClient}>
        <MemoryRouter>
          <PageBoundary>
            <RobotListPage fetchRobotPage={fetchRobotPage} />
          </PageBoundary>
        </MemoryRouter>
      </MosaicProvider>
    </MantineProvider>,
  )
}

test('the page of a robot is fetched beforehand once there is one, and it harms nobody that it can’t be', async () => {
  showList([])
  expect(await screen.findByText('No robots yet')).toBeTruthy()
  expect(fetchRobotPage).not.toHaveBeenCalled()
  cleanup()
  showList([ROBOT])
  expect(await screen.findByText('kitchen-bot')).toBeTruthy()
  expect(fetchRobotPage).toHaveBeenCalledOnce()
})

test('where the dialog for another robot can’t be fetched it says so, and the list stays', async () => {
  vi.spyOn(console, 'error').mockReturnValue()
  showList([ROBOT])
  await userEvent.click(screen.getByRole('button', { name: 'Add robot' }))
  expect((await screen.findByRole('alert')).textContent).toContain('could not be fetched')
  expect(screen.getByText('kitchen-bot')).toBeTruthy()
  await userEvent.click(screen.getByRole('button', { name: 'Hide this' }))
  expect(screen.queryByRole('alert')).toBeNull()
})
