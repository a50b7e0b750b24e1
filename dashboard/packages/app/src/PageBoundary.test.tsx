import { MantineProvider } from '@mantine/core'
import { cleanup, render, screen } from '@testing-library/react'
import { lazy, Suspense } from 'react'
import { afterEach, expect, test, vi } from 'vitest'
import { PageBoundary } from './PageBoundary'

afterEach(() => {
  cleanup()
  vi.restoreAllMocks()
})

test('a page whose script is gone says so and offers to reload', async () => {
  vi.spyOn(console, 'error').mockImplementation(() => undefined) // React tells it there too
  const Gone = lazy(() => Promise.reject(new TypeError('Failed to fetch dynamically imported module')))
  render(
    <MantineProvider env="test">
      <PageBoundary>
        <Suspense>
          <Gone />
        </Suspense>
      </PageBoundary>
    </MantineProvider>,
  )
  expect((await screen.findByRole('alert')).textContent).toContain('reload it')
  expect(screen.getByRole('button', { name: 'Reload' })).toBeDefined()
})

test('a page that can be shown is shown', () => {
  render(
    <MantineProvider env="test">
      <PageBoundary>the robot</PageBoundary>
    </MantineProvider>,
  )
  expect(screen.getByText('the robot')).toBeDefined()
  expect(screen.queryByRole('alert')).toBeNull()
})
