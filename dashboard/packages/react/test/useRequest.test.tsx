import { BidirectionalStore, MediaStreamStore } from '@mosaic/client'
import { act, cleanup, render, screen } from '@testing-library/react'
import { afterEach, expect, test, vi } from 'vitest'
import { MosaicProvider, useRequest, type Requests } from '../src/index'
import { offlineClient } from './offlineClient'

interface Sent {
  id: string
  question?: unknown
  cancel?: boolean
}

afterEach(cleanup)

const failed = (asked: Promise<unknown>): Promise<string> => asked.then(() => 'answered', (error: unknown) => (error as { code: string }).code)

/** A component that asks `files`, over an open channel whose messages the test reads. */
function asking() {
  const client = offlineClient()
  const store = client.storeManager.getOrCreateStore({ robotId: 'r', connectorId: 'files', dataType: 'json-bi' }, BidirectionalStore)
  const sent: Sent[] = []
  vi.spyOn(store, 'sendJson').mockImplementation((value) => sent.push(value as Sent) > 0)
  store.notifyAfterConnected()
  const shown: { requests: Requests<number, string> | null } = { requests: null }
  function Page() {
    const requests = useRequest<number, string>('r', 'files')
    shown.requests = requests
    return <p>{[requests.phase, JSON.stringify(requests.progress), requests.answer, requests.error?.code].join(' ')}</p>
  }
  const page = render(<MosaicProvider client={client}><Page /></MosaicProvider>)
  const ask = (...asked: Parameters<Requests<number, string>['ask']>): Promise<string> => {
    let answer: Promise<string> | undefined
    act(() => {
      answer = shown.requests?.ask(...asked)
    })
    return answer ?? Promise.reject(new Error('nothing was drawn'))
  }
  const says = (value: object) => act(async () => {
    store.notifySubscribers(new TextEncoder().encode(JSON.stringify(value)).buffer)
    await Promise.resolve()
  })
  return { page, sent, ask, says, cancel: () => act(() => shown.requests?.cancel()) }
}

test('a component shows how its request stands', async () => {
  const { sent, ask, says } = asking()
  const answer = ask(1)
  await says({ id: sent[0]?.id, progress: { seen: 3 } })
  expect(screen.getByText('asking {"seen":3}')).toBeDefined()
  await says({ id: sent[0]?.id, answer: 'one' })
  expect(screen.getByText('answered {"seen":3} one')).toBeDefined()
  expect(await answer).toBe('one')
})

test('of several it shows the newest, and each promise has its own answer', async () => {
  const { sent, ask, says } = asking()
  const answers = [ask(1), ask(2)]
  await says({ id: sent[1]?.id, answer: 'two' })
  await says({ id: sent[0]?.id, answer: 'one' })
  expect(screen.getByText('answered null two')).toBeDefined()
  expect(await Promise.all(answers)).toEqual(['one', 'two'])
})

test('the newest is taken back, and all are when the component goes', async () => {
  const { page, sent, ask, cancel } = asking()
  const ends = [failed(ask(1)), failed(ask(2))]
  cancel()
  expect(sent.slice(2)).toEqual([{ id: sent[1]?.id, cancel: true }])
  page.unmount()
  expect(sent.slice(3)).toEqual([{ id: sent[0]?.id, cancel: true }])
  expect(await Promise.all(ends)).toEqual(['request.cancelled', 'request.cancelled'])
})

test('a signal takes it back, also one that was given before', async () => {
  const { sent, ask } = asking()
  const abort = new AbortController()
  const end = failed(ask(1, { signal: abort.signal }))
  act(() => abort.abort())
  expect(await end).toBe('request.cancelled')
  expect(await failed(ask(2, { signal: abort.signal }))).toBe('request.cancelled')
  expect(sent.map(({ question, cancel }) => cancel ?? question)).toEqual([1, true])
})

test('a connector that the page shows as something else refuses, and the page stays', async () => {
  const client = offlineClient()
  client.storeManager.getOrCreateStore({ robotId: 'r', connectorId: 'front', dataType: 'media' }, MediaStreamStore)
  const shown: { requests: Requests<number, string> | null } = { requests: null }
  function Page() {
    shown.requests = useRequest<number, string>('r', 'front')
    return <p>{shown.requests.error?.message}</p>
  }
  render(<MosaicProvider client={client}><Page /></MosaicProvider>)
  await act(async () => expect(await failed(shown.requests?.ask(1) ?? Promise.resolve())).toBe('channel.wrong_direction'))
  expect(screen.getByText(/'front' answers no requests/)).toBeDefined()
})
