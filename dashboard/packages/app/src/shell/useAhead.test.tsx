import { Value, type MosaicClient, type ServerState } from '@mosaic/client'
import { MosaicProvider } from '@mosaic/react'
import { act, cleanup, renderHook } from '@testing-library/react'
import type { ReactNode } from 'react'
import { afterEach, beforeEach, expect, test, vi } from 'vitest'
import { IDLE_MS, useAhead } from './useAhead'

const server = new Value<ServerState>('online')
const load = vi.fn(() => Promise.resolve())
const LOADS = [() => Promise.reject(new Error('the server has gone meanwhile')), load]

beforeEach(() => {
  vi.useFakeTimers({ toFake: ['setTimeout', 'clearTimeout'] })
  load.mockClear()
  server.set('online')
})
afterEach(() => {
  cleanup()
  vi.unstubAllGlobals()
  vi.useRealTimers()
})

function opened() {
  const wrapper = ({ children }: { children: ReactNode }) => (
    <MosaicProvider client={{ server } as unknown as MosaicClient}>{children}</MosaicProvider>
  )
  return renderHook(() => useAhead(LOADS), { wrapper })
}

test('what is used later is fetched once the page is idle, and it harms nobody that some of it can’t be', () => {
  opened()
  expect(load).not.toHaveBeenCalled()
  act(() => void vi.advanceTimersByTime(IDLE_MS))
  expect(load).toHaveBeenCalledOnce()
})

test('a browser that knows when it is idle says so', () => {
  let idle = () => {}
  vi.stubGlobal('requestIdleCallback', (callback: () => void) => ((idle = callback), 7))
  const cancel = vi.fn()
  vi.stubGlobal('cancelIdleCallback', cancel)
  const { unmount } = opened()
  act(() => void vi.advanceTimersByTime(IDLE_MS))
  expect(load).not.toHaveBeenCalled()
  idle()
  expect(load).toHaveBeenCalledOnce()
  unmount()
  expect(cancel).toHaveBeenCalledWith(7)
})

test('it is asked for only while the server is there: a browser may keep that it got nothing', () => {
  server.set('offline')
  opened()
  act(() => void vi.advanceTimersByTime(IDLE_MS))
  expect(load).not.toHaveBeenCalled()
  act(() => server.set('online'))
  act(() => void vi.advanceTimersByTime(IDLE_MS))
  expect(load).toHaveBeenCalledOnce()
})
