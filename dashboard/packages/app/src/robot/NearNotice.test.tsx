import { MantineProvider } from '@mantine/core'
import { Value, type RobotConnection } from '@mosaic/client'
import { cleanup, render, screen } from '@testing-library/react'
import userEvent from '@testing-library/user-event'
import { afterEach, expect, test } from 'vitest'
import { NearNotice } from './NearNotice'

afterEach(() => {
  cleanup()
  localStorage.clear()
})

function shown(near: readonly string[]) {
  const connection = { robotId: 'r1', near: new Value(near) } as unknown as RobotConnection
  render(
    <MantineProvider>
      <NearNotice connection={connection} />
    </MantineProvider>,
  )
}

test('the robot’s own address is offered where it is on the path', () => {
  shown(['http://192.168.1.5:9002', 'http://rover.local:9002'])
  const link = screen.getByRole<HTMLAnchorElement>('link')
  expect(link.href).toBe('http://192.168.1.5:9002/robots/r1')
  expect(screen.getByRole('status').textContent).toContain('without the internet')
})

test('elsewhere nothing is said', () => {
  shown([])
  expect(screen.queryByRole('status')).toBeNull()
})

test('dismissed, it does not come back in this browser', async () => {
  shown(['http://192.168.1.5:9002'])
  await userEvent.setup().click(screen.getByRole('button', { name: 'Do not show this again' }))
  expect(screen.queryByRole('status')).toBeNull()
  cleanup()
  shown(['http://192.168.1.5:9002'])
  expect(screen.queryByRole('status')).toBeNull()
})
