import { MantineProvider } from '@mantine/core'
import { Value, type MosaicClient, type ServerState } from '@mosaic/client'
import { MosaicProvider } from '@mosaic/react'
import { act, cleanup, render, screen } from '@testing-library/react'
import { lazy, Suspense } from 'react'
import { afterEach, expect, test, vi } from 'vitest'
import { PageBoundary } from './PageBoundary'

afterEach(() => {
  cleanup()
  vi.restoreAllMocks()
  vi.unstubAllGlobals()
})

function showGone(server: Value<ServerState>) {
  vi.spyOn(console, 'error').mockImplementation(() => undefined) // React tells it there too
  const Gone = lazy(() => Promise.reject(new TypeError('Failed to fetch dynamically imported module')))
  render(
    <MantineProvider env="test">
      <MosaicProvider client={{ server } as unknown as MosaicClient}>
        <PageBoundary>
          <Suspense>
            <Gone />
          </Suspense>
        </PageBoundary>
      </MosaicProvider>
    </MantineProvider>,
  )
}

test.each<[ServerState, string]>([
  ['online', 'newer than the page'],
  ['offline', 'The server is away. This page reloads by itself'],
])('a page whose script is gone says so and offers to reload, the server being %s', async (state, cure) => {
  showGone(new Value(state))
  expect((await screen.findByRole('alert')).textContent).toContain(cure)
  expect(screen.getByRole('button', { name: 'Reload' })).toBeDefined()
})

test('it reloads by itself when the server is back, and only then', async () => {
  const reload = vi.fn()
  vi.stubGlobal('location', { reload })
  const server = new Value<ServerState>('offline')
  showGone(server)
  expect((await screen.findByRole('alert')).textContent).toContain('by itself')
  expect(reload).not.toHaveBeenCalled()
  act(() => server.set('online'))
  expect(reload).toHaveBeenCalledOnce()
})

test('while the server is here it is the person who reloads: the page might fail again', async () => {
  const reload = vi.fn()
  vi.stubGlobal('location', { reload })
  showGone(new Value<ServerState>('online'))
  await screen.findByRole('alert')
  expect(reload).not.toHaveBeenCalled()
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
