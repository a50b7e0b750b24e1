import type { ReceivableStore, RobotConnector } from '@mosaic/client'
import { act, render, screen } from '@testing-library/react'
import { StrictMode, useEffect, useState } from 'react'
import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest'
import { MosaicProvider, useMosaicClient, useMosaicStore, useReadable, useRobotConnection, useRobots } from '../src/index'
import { offlineClient } from './offlineClient'

// The widget of MOSAIC's documentation, unchanged; our own rules would write it otherwise.
/* eslint-disable @typescript-eslint/require-await, @typescript-eslint/no-unsafe-argument, @typescript-eslint/no-unsafe-member-access, react-hooks/exhaustive-deps */
function ValueWidget({ robotConnector }: { robotConnector: RobotConnector }) {
  const [value, setValue] = useState<number | null>(null)
  const { getOrCreateStore, releaseStore } = useMosaicStore()
  useEffect(() => {
    const store = getOrCreateStore(robotConnector) as ReceivableStore      // {robotId, connectorId, dataType}
    const unsubscribe = store.subscribe(async (buffer) => setValue(JSON.parse(new TextDecoder().decode(buffer)).value))
    return () => { unsubscribe(); releaseStore(robotConnector) }
  }, [robotConnector])
  return <p>value: {value ?? 'none'}</p>
}
/* eslint-enable */

const CONNECTOR: RobotConnector = { robotId: 'r', connectorId: 'battery', dataType: 'json-r2u' }

beforeEach(() => {
  vi.useFakeTimers()
})

afterEach(() => {
  vi.useRealTimers()
})

function bytes(text: string): ArrayBuffer {
  return new TextEncoder().encode(text).buffer
}

describe('the documented example', () => {
  test('shows what arrives', async () => {
    const client = offlineClient()
    render(
      <MosaicProvider client={client}>
        <ValueWidget robotConnector={CONNECTOR} />
      </MosaicProvider>,
    )
    expect(screen.getByText('value: none')).toBeDefined()
    const store = client.storeManager.getOrCreateStore(CONNECTOR) as ReceivableStore
    await act(async () => {
      store.notifySubscribers(bytes('{"value":42}'))
      await Promise.resolve()
    })
    expect(screen.getByText('value: 42')).toBeDefined()
  })

  test('mounted twice by StrictMode keeps one store, and lets go of it after a second', () => {
    const client = offlineClient()
    const added = vi.spyOn(client.connection('r'), 'addStore')
    const removed = vi.spyOn(client.connection('r'), 'removeStore')
    const page = render(
      <StrictMode>
        <MosaicProvider client={client}>
          <ValueWidget robotConnector={CONNECTOR} />
        </MosaicProvider>
      </StrictMode>,
    )
    vi.advanceTimersByTime(5000)
    expect(added).toHaveBeenCalledTimes(1)
    expect(removed).not.toHaveBeenCalled()
    const store = added.mock.calls[0]?.[0] as ReceivableStore
    expect(store.subscriberCount).toBe(1)
    page.unmount()
    expect(store.subscriberCount).toBe(0)
    vi.advanceTimersByTime(999)
    expect(removed).not.toHaveBeenCalled()
    vi.advanceTimersByTime(2)
    expect(removed).toHaveBeenCalledTimes(1)
  })
})

describe('hooks', () => {
  test('without a provider say what is missing', () => {
    const quiet = vi.spyOn(console, 'error').mockImplementation(() => {})
    const Lost = () => <p>{useMosaicClient().server.get()}</p>
    expect(() => render(<Lost />)).toThrow('no MosaicProvider above this component')
    quiet.mockRestore()
  })

  test('give the robots, and one and the same connection', () => {
    const client = offlineClient()
    const seen = new Set<unknown>()
    function Page() {
      const connection = useRobotConnection('r')
      seen.add(connection)
      return (
        <p>
          {useRobots().length} robots, {useReadable(connection.state).phase}
        </p>
      )
    }
    const page = (
      <MosaicProvider client={client}>
        <Page />
      </MosaicProvider>
    )
    const { rerender } = render(page)
    expect(screen.getByText('0 robots, idle')).toBeDefined()
    rerender(page)
    act(() => client.connection('r').connect())
    expect(screen.getByText('0 robots, connecting')).toBeDefined()
    expect(seen).toEqual(new Set([client.connection('r')]))
  })
})
