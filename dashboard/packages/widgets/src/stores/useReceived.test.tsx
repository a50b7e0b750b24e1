import { act, cleanup, render, screen } from '@testing-library/react'
import { afterEach, expect, test } from 'vitest'
import type { AnyStore, ReceivedMessage } from './storeKinds'
import { useLatestJson } from './useReceived'

afterEach(cleanup)

/** A store that a test fills. */
class FilledStore {
  latest: ReceivedMessage | null = null
  private listener: (data: ArrayBuffer) => void = () => {}

  subscribe(listener: (data: ArrayBuffer) => void): () => void {
    this.listener = listener
    return () => {}
  }

  fill(text: string): void {
    const data = new TextEncoder().encode(text).buffer
    this.latest = { data, info: { receivedAtMs: 0, ageMs: null } as ReceivedMessage['info'] }
    this.listener(data)
  }
}

function Shown({ store }: { store: FilledStore }) {
  return <output>{JSON.stringify(useLatestJson(store as unknown as AnyStore, 0))}</output>
}

test('the latest message is shown as JSON, and nothing before it or where it is none', async () => {
  const store = new FilledStore()
  render(<Shown store={store} />)
  expect(screen.getByRole('status').textContent).toBe('null')
  act(() => store.fill('{"angle_rad":1}'))
  expect(screen.getByRole('status').textContent).toBe('{"angle_rad":1}')
  act(() => store.fill('{'))
  expect(await screen.findByText('null')).toBeDefined()
})
