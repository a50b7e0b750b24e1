import { MantineProvider } from '@mantine/core'
import { Value, type MosaicClient, type ServerState } from '@mosaic/client'
import { MosaicProvider } from '@mosaic/react'
import { cleanup, render, screen } from '@testing-library/react'
import { lazy, Suspense } from 'react'
import { afterEach, expect, test, vi } from 'vitest'
import { PageBoundary } from './PageBoundary'

afterEach(() => {
  cleanup()
  vi.restoreAllMocks()
})

test.each<[ServerState, string]>([
  ['online', 'newer than the page'],
  ['offline', 'The server is away: reload'],
])('a page whose script is gone says so and offers to reload, the server being %s', async (state, cure) => {
  vi.spyOn(console, 'error').mockImplementation(() => undefined) // React tells it there too
  const Gone = lazy(() => Promise.reject(new TypeError('Failed to fetch dynamically imported module')))
  render(
    <MantineProvider env="test">
      <MosaicProvider client={{ server: new Value(state) } as unknown as MosaicClient}>
        <PageBoundary>
          <Suspense>
            <Gone />
          </Suspense>
        </PageBoundary>
      </MosaicProvider>
    </MantineProvider>,
  )
  expect((await screen.findByRole('alert')).textContent).toContain(cure)
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
