import { MantineProvider } from '@mantine/core'
import { MosaicError, Value, type JournalEntry, type MosaicClient } from '@mosaic/client'
import { MosaicProvider } from '@mosaic/react'
import { act, cleanup, render, screen } from '@testing-library/react'
import userEvent from '@testing-library/user-event'
import { afterEach, beforeEach, expect, test, vi } from 'vitest'
import JournalDrawer from './JournalDrawer'

const entry = (number: number, what: string, rest: Partial<JournalEntry> = {}): JournalEntry => ({
  number,
  at: '2026-03-01T14:03:07Z',
  what,
  who: 'Alice',
  subject: '',
  code: '',
  message: '',
  ...rest,
})

class FakeDesk {
  readonly availability = new Value('available')
  readonly me = new Value(null)
  readonly peers = new Value([])
  readonly leases = new Value({})
  readonly read: unknown[][] = []
  answer: () => Promise<readonly JournalEntry[]> = () => Promise.resolve([])
  readJournal(...asked: unknown[]): Promise<readonly JournalEntry[]> {
    this.read.push(asked)
    return this.answer()
  }
}

let desk: FakeDesk

beforeEach(() => {
  desk = new FakeDesk()
})

afterEach(() => {
  cleanup()
  vi.restoreAllMocks()
  vi.useRealTimers()
})

function shown(): void {
  const client = { connection: () => ({ control: desk }) } as unknown as MosaicClient
  render(
    <MantineProvider env="test">
      <MosaicProvider client={client}>
        <JournalDrawer robotId="r" name="Robbie" onClose={() => {}} />
      </MosaicProvider>
    </MantineProvider>,
  )
}

const shownEntries = () => screen.getAllByRole('listitem').map(({ textContent }) => textContent)

test('entries are shown newest first, with their reason in words', async () => {
  desk.answer = () => Promise.resolve([entry(2, 'lease.ended', { code: 'lease.taken_over', message: 'smoke' }), entry(1, 'stop')])
  shown()
  await screen.findByText('Lease ended')
  const [day, newest, oldest] = shownEntries()
  expect(day).toBe('2026-03-01')
  expect(newest).toContain('A supervisor took the lease over. smoke')
  expect(oldest).toContain('Stop')
})

test('whose account it was is told beside the name', async () => {
  desk.answer = () => Promise.resolve([entry(1, 'stop', { account: '7d1c2f6e' })])
  shown()
  expect((await screen.findByText('Alice')).title).toBe('Account 7d1c2f6e')
})

test('a filter and a topic leave out the rest', async () => {
  desk.answer = () => Promise.resolve([entry(3, 'command.refused', { who: 'Bob' }), entry(2, 'stop'), entry(1, 'peer.connected', { who: 'Bob' })])
  shown()
  await screen.findByText('Stop')
  await userEvent.type(screen.getByLabelText('Filter the journal'), 'bob')
  expect(shownEntries()).toHaveLength(3)
  await userEvent.click(screen.getByText('Refusals'))
  expect(shownEntries().join()).toContain('Command refused')
  expect(shownEntries()).toHaveLength(2)
})

test('older entries are read from where the known ones end', async () => {
  const page = Array.from({ length: 100 }, (_, index) => entry(200 - index, 'command.accepted'))
  desk.answer = () => Promise.resolve(desk.read.length === 1 ? page : [entry(100, 'stop')])
  shown()
  await userEvent.click(await screen.findByRole('button', { name: 'Older entries' }))
  expect(desk.read.at(-1)).toEqual([100, 101])
  expect(screen.getByText('Stop')).toBeTruthy()
  expect(screen.queryByRole('button', { name: 'Older entries' })).toBeNull()
})

test('what happens meanwhile appears by itself', async () => {
  vi.useFakeTimers()
  shown()
  await act(() => vi.advanceTimersByTimeAsync(0))
  desk.answer = () => Promise.resolve([entry(1, 'stop')])
  await act(() => vi.advanceTimersByTimeAsync(3000))
  expect(screen.getByText('Stop')).toBeTruthy()
})

test('a refusal is said', async () => {
  desk.answer = () => Promise.reject(new MosaicError('auth.forbidden'))
  shown()
  expect((await screen.findByRole('alert')).textContent).toContain('may not do that')
})

test('what is shown can be exported', async () => {
  desk.answer = () => Promise.resolve([entry(1, 'stop')])
  const made: Blob[] = []
  vi.spyOn(URL, 'createObjectURL').mockImplementation((blob) => {
    made.push(blob as Blob)
    return 'blob:x'
  })
  vi.spyOn(HTMLAnchorElement.prototype, 'click').mockImplementation(() => {})
  shown()
  await screen.findByText('Stop')
  await userEvent.click(screen.getByRole('button', { name: 'Export' }))
  expect(JSON.parse((await made[0]?.text()) ?? '')).toEqual([entry(1, 'stop')])
})
