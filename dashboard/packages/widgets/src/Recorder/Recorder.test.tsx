import { Value, type CatalogueEntry, type MessageInfo, type Refusal, type StoreState } from '@mosaic/client'
import { act, cleanup, fireEvent, render, screen, waitFor } from '@testing-library/react'
import userEvent from '@testing-library/user-event'
import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest'
import { FakeConnection, WithRobot } from '../../test/fakeRobot'
import { chooseWidget } from '../registry/chooseWidget'
import { widgets } from '../widgets'
import type { AnyStore } from '../stores/storeKinds'
import { Recorder } from './Recorder'
import { formattedBytes, formattedDuration, recorderMessage } from './recorderMessages'

const ENTRY: CatalogueEntry = {
  label: 'recorder',
  type: 'recorder',
  kind: 'data',
  dataType: 'json-bi',
  direction: 'both',
  channels: [],
  delivery: 'reliable',
  widget: 'recorder',
}
const ROW = { label: 'front', state: 'recording', files: ['a.mp4'], seconds: 187.4, bytes: 1_240_000, pictures: 30, dropped: 0, width: 640, height: 480, code: '' }
const IDLE = { type: 'status', state: 'idle', labels: ['front'], recordings: [], seconds: 0, bytes: 0, dropped: 0, free_bytes: 12e9, code: '' }
const RUNNING = { ...IDLE, state: 'recording', recordings: [ROW], seconds: 187.4 }

class FakeStore {
  readonly state = new Value<StoreState>({ phase: 'open' })
  readonly lastRefusal = new Value<Refusal | null>(null)
  readonly sent: Record<string, unknown>[] = []
  readonly latest = null
  private listener: (data: ArrayBuffer, info?: MessageInfo) => void = () => {}
  subscribe(listener: (data: ArrayBuffer) => void): () => void {
    this.listener = listener
    return () => {}
  }
  sendData(text: string): boolean {
    return this.sent.push(JSON.parse(text) as Record<string, unknown>) > 0
  }
  say(value: unknown): void {
    act(() => this.listener(new TextEncoder().encode(JSON.stringify(value)).buffer))
  }
}

let store: FakeStore

beforeEach(() => {
  store = new FakeStore()
})

afterEach(() => {
  cleanup()
  vi.restoreAllMocks()
  vi.useRealTimers()
})

function shown(first: object = IDLE): void {
  render(
    <WithRobot connection={new FakeConnection()}>
      <Recorder robotId="r" entry={ENTRY} store={store as unknown as AnyStore} />
    </WithRobot>,
  )
  store.say(first)
}

const press = (name: string) => userEvent.click(screen.getByRole('button', { name }))

test('is what a recorder is shown with', () => expect(chooseWidget(widgets, ENTRY)?.id).toBe('recorder'))

test.each([
  [IDLE, 'Record', 'start'],
  [RUNNING, 'End', 'stop'],
  [RUNNING, 'Pause', 'pause'],
  [{ ...RUNNING, state: 'paused' }, 'Go on', 'resume'],
])('in %j, %s says %s', async (status, name, command) => {
  shown(status)
  await press(name)
  expect(store.sent).toEqual([{ command }])
})

test('what is recorded is shown per camera, with its end in words', () => {
  shown(RUNNING)
  expect(screen.getByRole('listitem').textContent).toBe('front recording · 3:07 · 1.2 MB')
  store.say({ ...RUNNING, state: 'idle', recordings: [{ ...ROW, state: 'ended', code: 'recorder.disk_full', dropped: 3 }] })
  expect(screen.getByRole('listitem').textContent).toContain('3 pictures lost')
  expect(screen.getByRole('listitem').textContent).toContain('disk is full')
})

test('data is shown beside the cameras, with how many messages', () => {
  const data = { ...ROW, kind: 'data', label: 'data', messages: 5120, bytes: 210_000 }
  shown({ ...RUNNING, recordings: [ROW, data] })
  const [, row] = screen.getAllByRole('listitem')
  expect(row?.textContent).toBe('data recording · 3:07 · 210 kB · 5120 messages')
  store.say({ ...RUNNING, recordings: [{ ...data, dropped: 3 }] })
  expect(screen.getByRole('listitem').textContent).toContain('3 messages lost')
})

test('a still that this page asked for is saved here, too; another page’s is not', async () => {
  const made: string[] = []
  vi.spyOn(URL, 'createObjectURL').mockReturnValue('blob:x')
  vi.spyOn(HTMLAnchorElement.prototype, 'click').mockImplementation(function (this: HTMLAnchorElement) {
    made.push(this.download)
  })
  shown()
  await press('Still')
  const answer = { type: 'snapshot', label: 'front', file: 'front.png', png_base64: btoa('png'), code: '' }
  store.say({ ...answer, request_id: 'somebody else' })
  expect(made).toEqual([])
  store.say({ ...answer, request_id: store.sent[0]?.['request_id'] })
  expect(made).toEqual(['front.png'])
})

test('files are listed, and deleted only by holding', async () => {
  shown()
  await press('Files')
  expect(store.sent).toEqual([{ command: 'list' }])
  store.say({ type: 'files', directory: '/data', request_id: '', free_bytes: 1, files: [{ name: 'a.mp4', label: 'front', bytes: 5e6, modified_at_s: 1.7e9, is_open: false }] })
  await userEvent.click(await screen.findByRole('button', { name: 'Delete a.mp4' }))
  const hold = screen.getByRole('button', { name: 'Hold to delete' })
  expect(store.sent).toHaveLength(1)
  fireEvent.pointerDown(hold, { button: 0 })
  await waitFor(() => expect(store.sent.at(-1)).toEqual({ command: 'delete', files: ['a.mp4'] }), { timeout: 4000 })
})

test('a refusal is said with its cure', () => {
  shown()
  act(() => store.lastRefusal.set({ label: 'recorder', code: 'recorder.disk_full' }))
  expect(screen.getByText(/Refused: The robot’s disk|Refused: The robot's disk/)).toBeTruthy()
})

describe('messages', () => {
  test.each([null, 5, {}, { type: 'other' }])('%j is none of a recorder', (value) => expect(recorderMessage(value)).toBeNull())

  test('fields that are missing or wrong do no harm', () => {
    expect(recorderMessage({ type: 'status', state: 'x', recordings: [null], free_bytes: 'much' })).toMatchObject({ state: 'idle', freeBytes: null })
    expect(recorderMessage({ type: 'files', files: 'none' })).toEqual({ type: 'files', directory: '', files: [] })
  })

  test.each([
    [7.9, '0:07'],
    [187, '3:07'],
    [3723, '1:02:03'],
  ])('%s s reads %s', (seconds, text) => expect(formattedDuration(seconds)).toBe(text))

  test.each([
    [12, '12 B'],
    [1240, '1.2 kB'],
    [48e9, '48 GB'],
  ])('%s bytes read %s', (bytes, text) => expect(formattedBytes(bytes)).toBe(text))
})
