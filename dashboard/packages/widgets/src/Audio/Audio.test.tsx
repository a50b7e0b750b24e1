import { Value, type CatalogueEntry, type MediaStatistics, type StoreState } from '@mosaic/client'
import { act, cleanup, render, screen } from '@testing-library/react'
import userEvent from '@testing-library/user-event'
import { afterEach, beforeEach, expect, test, vi } from 'vitest'
import { FakeConnection, WithRobot } from '../../test/fakeRobot'
import type { AnyStore } from '../stores/storeKinds'
import { Audio } from './Audio'

const ENTRY: CatalogueEntry = {
  label: 'cabin',
  type: 'microphone',
  kind: 'audio',
  dataType: 'media',
  direction: 'to-operator',
  channels: [],
  delivery: 'latest',
}

class FakeMedia {
  readonly state = new Value<StoreState>({ phase: 'open' })
  readonly mediaStream = new Value<MediaStream | null>(null)
  readonly statistics = new Value<MediaStatistics | null>(null)
  readonly displayedAgeMs = new Value<number | null>(null)
}

let store: FakeMedia
let contexts: FakeAudioContext[]

class FakeAudioContext {
  isClosed = false
  level = 0
  constructor() {
    contexts.push(this)
  }
  createAnalyser() {
    return { fftSize: 0, getFloatTimeDomainData: (samples: Float32Array) => samples.fill(this.level) }
  }
  createMediaStreamSource() {
    return { connect: () => {} }
  }
  resume = () => Promise.resolve()
  close = () => {
    this.isClosed = true
    return Promise.resolve()
  }
}

const audio = (): HTMLAudioElement => screen.getByLabelText<HTMLAudioElement>('Sound of cabin')
const meter = (): HTMLElement => screen.getByRole('meter')

beforeEach(() => {
  store = new FakeMedia()
  contexts = []
  vi.stubGlobal('AudioContext', FakeAudioContext)
  const media = HTMLMediaElement.prototype as unknown as Record<string, unknown>
  media['play'] = () => Promise.resolve()
  render(
    <WithRobot connection={new FakeConnection()}>
      <Audio robotId="r" entry={ENTRY} store={store as unknown as AnyStore} />
    </WithRobot>,
  )
})

afterEach(() => {
  cleanup()
  vi.useRealTimers()
  vi.unstubAllGlobals()
})

test('nobody listens before somebody wants to', async () => {
  expect(store.mediaStream.listenerCount).toBe(0)
  await userEvent.click(screen.getByRole('button', { name: 'Listen' }))
  expect(store.mediaStream.listenerCount).toBe(1)
  await userEvent.click(screen.getByRole('button', { name: 'Stop listening' }))
  expect(store.mediaStream.listenerCount).toBe(0)
})

test('the sound is played and its level shown, until the end', async () => {
  await userEvent.click(screen.getByRole('button', { name: 'Listen' }))
  vi.useFakeTimers()
  act(() => store.mediaStream.set(new MediaStream()))
  expect(audio().srcObject).toBeInstanceOf(MediaStream)
  const [context] = contexts
  if (context === undefined) throw new Error('no meter')
  context.level = 0.1
  vi.advanceTimersByTime(100)
  expect(meter().getAttribute('aria-valuenow')).toBe('-20')
  act(() => store.mediaStream.set(null))
  expect(meter().getAttribute('aria-valuenow')).toBe('-60')
  expect(context.isClosed).toBe(true)
  expect(audio().srcObject).toBeNull()
})

test('mute silences the sound and not the meter', async () => {
  await userEvent.click(screen.getByRole('button', { name: 'Mute' }))
  expect(audio().muted).toBe(true)
  expect(screen.getByRole('button', { name: 'Mute' }).getAttribute('aria-pressed')).toBe('true')
  await userEvent.click(screen.getByRole('button', { name: 'Mute' }))
  expect(audio().muted).toBe(false)
})

test('the volume follows the keyboard', async () => {
  screen.getByRole('slider', { name: 'Volume' }).focus()
  await userEvent.keyboard('{ArrowLeft}{ArrowLeft}')
  expect(audio().volume).toBeCloseTo(0.98)
})

test('a browser that wants a click first shows the button again', async () => {
  const media = HTMLMediaElement.prototype as unknown as Record<string, unknown>
  media['play'] = () => Promise.reject(new DOMException('', 'NotAllowedError'))
  await userEvent.click(screen.getByRole('button', { name: 'Listen' }))
  await act(async () => {
    store.mediaStream.set(new MediaStream())
    await Promise.resolve()
  })
  expect(screen.getByRole('button', { name: 'Listen' })).toBeTruthy()
})
