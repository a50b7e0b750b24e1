import { afterEach, beforeEach, expect, test, vi } from 'vitest'
import { answerPatienceMs, RequestCaller } from '../../src/requests/RequestCaller'
import { BidirectionalStore } from '../../src/stores/BidirectionalStore'

interface Sent {
  id: string
  question?: unknown
  cancel?: boolean
}

const bytes = (value: unknown): ArrayBuffer => new TextEncoder().encode(JSON.stringify(value)).buffer

beforeEach(() => void vi.useFakeTimers())
afterEach(() => void vi.useRealTimers())

/** A store whose messages a test reads, and the caller that uses it. */
function opened({ outlives = false } = {}) {
  const store = new BidirectionalStore({ robotId: 'r', connectorId: 'files' })
  const sent: Sent[] = []
  vi.spyOn(store, 'sendJson').mockImplementation((value) => sent.push(value as Sent) > 0)
  vi.spyOn(store, 'outlivesConnection', 'get').mockReturnValue(outlives)
  store.notifyAfterConnected()
  return { store, sent, caller: new RequestCaller(store), says: (value: unknown) => store.notifySubscribers(bytes(value)) }
}

const failed = (asked: Promise<unknown>): Promise<string> => asked.then(() => 'answered', (error: unknown) => (error as { code: string }).code)

test('each question gets its own answer, whatever their order', async () => {
  const { caller, sent, says } = opened()
  const told: unknown[] = []
  const one = caller.request({ n: 1 }, { onProgress: (value) => told.push(value) })
  const other = caller.request({ n: 2 })
  expect(sent.map(({ question }) => question)).toEqual([{ n: 1 }, { n: 2 }])
  says({ id: sent[0]?.id, progress: 50 })
  says({ id: sent[1]?.id, answer: 'two' })
  says({ id: sent[0]?.id, answer: 'one' })
  expect(await Promise.all([one, other])).toEqual(['one', 'two'])
  expect(told).toEqual([50])
})

test('a refusal has the code and the text of the robot', async () => {
  const { caller, sent, says } = opened()
  const asked = caller.request({})
  says({ id: sent[0]?.id, refused: { code: 'files.outside', message: 'only below home' } })
  await expect(asked).rejects.toMatchObject({ code: 'files.outside', message: 'only below home' })
})

test('what gets no answer in time is taken back', async () => {
  const { caller, sent } = opened()
  const asked = failed(caller.request({}, { timeoutMs: 1000 }))
  vi.advanceTimersByTime(1000)
  expect(await asked).toBe('request.timeout')
  expect(sent[1]).toEqual({ id: sent[0]?.id, cancel: true })
})

test('who aborts takes the request back, and hears no late answer', async () => {
  const { caller, sent, says } = opened()
  const abort = new AbortController()
  const asked = failed(caller.request({}, { signal: abort.signal }))
  abort.abort()
  says({ id: sent[0]?.id, answer: 1 })
  expect(await asked).toBe('request.cancelled')
  expect(sent[1]?.cancel).toBe(true)
})

test('a question that comes before the channel waits for it', async () => {
  const store = new BidirectionalStore({ robotId: 'r', connectorId: 'files' })
  const caller = new RequestCaller(store)
  const asked = failed(caller.request({}))
  const send = vi.spyOn(store, 'sendJson').mockReturnValue(true)
  store.notifyAfterConnected()
  expect(send).toHaveBeenCalledTimes(1)
  store.notifyAfterDisconnected()
  expect(await asked).toBe('request.lost')
})

test('a lost connection that comes back keeps what outlives it', async () => {
  const kept = opened({ outlives: true })
  const asked = kept.caller.request({})
  kept.store.notifyInterrupted()
  kept.store.notifyAfterConnected()
  kept.says({ id: kept.sent[0]?.id, answer: 1 })
  expect(await asked).toBe(1)

  const moving = opened()
  const lost = failed(moving.caller.request({}))
  moving.store.notifyInterrupted()
  expect(await lost).toBe('request.lost')
})

test('messages that never arrive may have been answers', async () => {
  const { caller, store } = opened({ outlives: true })
  const asked = failed(caller.request({}))
  store.missed({ lost: null, sent: false, atMs: 0 })
  expect(await asked).toBe('request.lost')
})

test('what may not be sent says why', async () => {
  const { caller, store } = opened()
  vi.spyOn(store, 'sendJson').mockReturnValue(false)
  store.setSendBlock({ code: 'lease.not_holder' })
  expect(await failed(caller.request({}))).toBe('lease.not_holder')
})

test('a robot without such a connector says so', async () => {
  const { caller, store } = opened()
  const asked = failed(caller.request({}))
  store.setState({ phase: 'mismatch', code: 'channel.unknown_label', message: "no 'file'; did you mean 'files'?" })
  expect(await asked).toBe('channel.unknown_label')
  await expect(caller.request({})).rejects.toThrow("no 'file'; did you mean 'files'?")
})

test('closing takes everything back', async () => {
  const { caller, sent } = opened()
  const asked = failed(caller.request({}))
  caller.close()
  expect(await asked).toBe('request.cancelled')
  expect(sent.at(-1)?.cancel).toBe(true)
})

test('an answer is waited for a little longer than its class gives itself', () => {
  const entry = { label: 'files', type: 'files', dataType: 'json-bi', kind: 'data', direction: 'both', channels: [], delivery: 'reliable' } as const
  expect(answerPatienceMs({ entries: [{ ...entry, answerWithinS: 300 }] }, 'files')).toBe(305_000)
  expect(answerPatienceMs({ entries: [entry] }, 'files')).toBe(30_000)
  expect(answerPatienceMs(null, 'files')).toBe(30_000)
})
