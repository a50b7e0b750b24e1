import { MantineProvider } from '@mantine/core'
import { RobotStatus, Value, type ConnectionState, type MosaicClient, type RobotConnection, type RobotSummary, type ServerState } from '@mosaic/client'
import { MosaicProvider } from '@mosaic/react'
import { act, cleanup, render, screen } from '@testing-library/react'
import { MemoryRouter } from 'react-router-dom'
import { afterEach, beforeEach, expect, test, vi } from 'vitest'
import { ServerBanner } from '../shell/ServerBanner'
import { ConnectionBadge } from './ConnectionBadge'
import { ConnectionNotice } from './ConnectionNotice'

const ROBOT: RobotSummary = {
  id: 'r', name: 'Robbie', description: '', status: RobotStatus.DISCONNECTED, isOnline: false, authType: 1, organizationId: 'o',
}
const server = new Value<ServerState>('online')
const state = new Value<ConnectionState>({ phase: 'failed', code: 'signal.robot_offline', roundTripMs: null })

beforeEach(() => {
  vi.useFakeTimers()
  server.set('online')
})
afterEach(() => {
  cleanup()
  vi.useRealTimers()
})

function shown(): string {
  const connection = { state, failedTimeline: new Value(null) } as unknown as RobotConnection
  const { container } = render(
    <MantineProvider env="test">
      <MosaicProvider client={{ server } as unknown as MosaicClient}>
        <MemoryRouter>
          <ServerBanner />
          <ConnectionBadge connection={connection} isOnline={ROBOT.isOnline} />
          <ConnectionNotice connection={connection} robot={ROBOT} />
        </MemoryRouter>
      </MosaicProvider>
    </MantineProvider>,
  )
  return container.textContent
}

test('a robot that is offline is started with `mosaic run`', () => {
  expect(shown()).toContain('Start it with `mosaic run`')
  expect(screen.getByText('Offline')).toBeTruthy()
  expect(screen.getByRole('button', { name: 'Offline: try again' })).toBeTruthy()
})

test('a server that is away is named alone: nothing is known of the robot then', () => {
  shown()
  act(() => server.set('offline'))
  act(() => void vi.advanceTimersByTime(1600))
  expect(document.body.textContent).toContain('No connection to the server')
  expect(document.body.textContent).not.toMatch(/[Oo]ffline|mosaic run/)
  act(() => server.set('online'))
  expect(document.body.textContent).not.toContain('No connection to the server')
  expect(screen.getByText('Offline')).toBeTruthy()
})
