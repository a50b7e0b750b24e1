import { BidirectionalStore, type CatalogueEntry } from '@mosaic/client'
import { act, cleanup, render, screen } from '@testing-library/react'
import userEvent from '@testing-library/user-event'
import { afterEach, expect, test, vi } from 'vitest'
import { FakeConnection, WithRobot } from '../../test/fakeRobot'
import { chooseWidget } from '../registry/chooseWidget'
import { widgets } from '../widgets'
import { RequestPanel } from './RequestPanel'

const ENTRY: CatalogueEntry = {
  label: 'survey',
  type: 'sim-survey',
  kind: 'data',
  dataType: 'json-bi',
  direction: 'both',
  channels: [],
  delivery: 'reliable',
  widget: 'request',
  messageSchema: { properties: { duration_s: { type: 'number', default: 3 } } },
  answerSchema: { properties: { nearest_m: { type: 'number' }, steps: { type: 'array' }, ids: { type: 'array' } } },
}

interface Sent {
  id: string
  question?: unknown
  cancel?: boolean
}

afterEach(cleanup)

function shown() {
  const store = new BidirectionalStore({ robotId: 'r', connectorId: 'survey' })
  const sent: Sent[] = []
  vi.spyOn(store, 'sendJson').mockImplementation((value) => sent.push(value as Sent) > 0)
  store.notifyAfterConnected()
  const storeManager = { getOrCreateStore: () => store, releaseStore: () => {} }
  const page = render(
    <WithRobot connection={new FakeConnection()} client={{ storeManager }}>
      <RequestPanel robotId="r" entry={ENTRY} store={store} />
    </WithRobot>,
  )
  const says = (value: object) => act(async () => {
    store.notifySubscribers(new TextEncoder().encode(JSON.stringify({ id: sent[0]?.id, ...value })).buffer)
    await Promise.resolve()
  })
  return { store, sent, says, page }
}

const press = (name: string) => userEvent.click(screen.getByRole('button', { name }))

test('a connector that answers requests gets this widget by itself', () => {
  expect(chooseWidget(widgets, ENTRY)?.id).toBe('request')
})

test('the question comes from the schema, the answer is shown by its own', async () => {
  const { sent, says } = shown()
  await press('Ask')
  expect(sent[0]?.question).toEqual({ duration_s: 3 })
  await says({ progress: { percent: 40 } })
  expect(screen.getByRole('progressbar').getAttribute('value')).toBe('40')
  expect(screen.getByRole('status').textContent).toContain('40')
  await says({ answer: { nearest_m: 1.25 } })
  expect(screen.getByLabelText('Answer').textContent).toContain('1.250 m')
  expect(screen.queryByRole('progressbar')).toBeNull()
})

test('every item of a list in an answer is shown, and of too many how many more there are', async () => {
  const { says } = shown()
  await press('Ask')
  const steps = Array.from({ length: 201 }, (_, number) => ({ step: `s${number}`, passed: number !== 1 }))
  await says({ answer: { nearest_m: 1, steps, ids: [7, 'x'] } })
  const items = screen.getAllByRole('listitem').map(({ textContent }) => textContent)
  expect(items.slice(0, 2)).toEqual(['Step s0, Passed yes', 'Step s1, Passed no'])
  expect(items.slice(200)).toEqual(['and 1 more', '7', 'x'])
})

test('a request is taken back by its button, and when the card goes', async () => {
  const { sent, page } = shown()
  await press('Ask')
  await press('Cancel')
  expect(sent[1]).toEqual({ id: sent[0]?.id, cancel: true })
  expect(await screen.findByText(/taken back/)).toBeDefined()
  await press('Ask')
  page.unmount()
  expect(sent.at(-1)).toEqual({ id: sent[2]?.id, cancel: true })
})

test('a refusal is told with its text', async () => {
  const { says } = shown()
  await press('Ask')
  await says({ refused: { code: 'survey.dark', message: 'it is too dark' } })
  expect(screen.getByRole('status').textContent).toContain('it is too dark')
})

test('a question that is not whole is not sent, and while somebody else commands nothing is', async () => {
  const { store } = shown()
  const field = screen.getByLabelText('Duration (s)')
  await userEvent.clear(field)
  await userEvent.type(field, 'long')
  expect(screen.getByRole('status').textContent).toContain('Duration is no number')
  expect(screen.getByRole<HTMLButtonElement>('button', { name: 'Ask' }).disabled).toBe(true)
  await userEvent.clear(field)
  await userEvent.type(field, '5')
  expect(screen.getByRole<HTMLButtonElement>('button', { name: 'Ask' }).disabled).toBe(false)
  act(() => store.setSendBlock({ code: 'lease.not_holder' }))
  expect(screen.getByRole('status').textContent).toContain('Somebody else commands')
  expect(screen.getByRole<HTMLButtonElement>('button', { name: 'Ask' }).disabled).toBe(true)
})
