import { Value, type MosaicClient, type RobotSummary } from '@mosaic/client'
import { act, renderHook } from '@testing-library/react'
import type { ReactNode } from 'react'
import { expect, test, vi } from 'vitest'
import { MosaicProvider, useConnectedRobot } from '../src/index'

const told = (isOnline: boolean) => [{ id: 'r', isOnline } as RobotSummary]

test('a robot is connected while the component is there, and again at once when it comes back', () => {
  const robots = new Value<readonly RobotSummary[]>([])
  const connection = { connect: vi.fn(), disconnect: vi.fn() }
  const client = { robots, connection: () => connection } as unknown as MosaicClient
  const wrapper = ({ children }: { children: ReactNode }) => <MosaicProvider client={client}>{children}</MosaicProvider>
  const { result, unmount } = renderHook(() => useConnectedRobot('r'), { wrapper })
  expect(result.current).toBe(connection)
  expect(connection.connect).toHaveBeenCalledTimes(1)
  act(() => robots.set(told(false)))
  expect(connection.connect).toHaveBeenCalledTimes(1)
  act(() => robots.set(told(true)))
  expect(connection.connect).toHaveBeenCalledTimes(2)
  act(() => robots.set([...told(true)]))
  expect(connection.connect).toHaveBeenCalledTimes(2)
  expect(connection.disconnect).not.toHaveBeenCalled()
  unmount()
  expect(connection.disconnect).toHaveBeenCalledTimes(1)
})
