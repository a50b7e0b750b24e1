import { Value, type CatalogueEntry, type MediaStatistics, type Received, type Shown, type ShownPicture, type StoreState } from '@mosaic/client'
import { act, cleanup, render, screen } from '@testing-library/react'
import userEvent from '@testing-library/user-event'
import { afterEach, beforeEach, expect, test, vi } from 'vitest'
import { FakeConnection, WithRobot } from '../../test/fakeRobot'
import type { AnyStore } from '../stores/storeKinds'
import { addPicture } from '../frame/picturesInSight'
import { Video } from './Video'

const ENTRY: CatalogueEntry = {
  label: 'front',
  type: 'camera',
  kind: 'video',
  dataType: 'media',
  direction: 'to-operator',
  channels: [],
  delivery: 'reliable',
}

class FakeMedia {
  readonly state = new Value<StoreState>({ phase: 'open' })
  readonly mediaStream = new Value<MediaStream | null>(null)
  readonly statistics = new Value<MediaStatistics | null>(null)
  arrived: Received | null = null

  received(): Promise<Received | null> {
    return Promise.resolve(this.arrived)
  }

  readonly displayedAgeMs = new Value<number | null>(42)
  readonly shown: (number | null)[] = []
  latestPicture: ShownPicture | null = null
  readonly targets: (number | null)[] = []
  pictureShown(rtpTimestamp: number | null, shownAtMs: number): void {
    this.shown.push(rtpTimestamp)
    this.latestPicture = { shownAtMs, ageMs: 42 }
  }
  setBufferTarget(targetMs: number | null): void {
    this.targets.push(targetMs)
  }
  readonly sizes: Shown[] = []
  setShown(shown: Shown): void {
    this.sizes.push(shown)
  }
  isKept = false
  keep(): () => void {
    this.isKept = true
    return () => {
      this.isKept = false
    }
  }
}

class FakeRecorder extends EventTarget {
  static readonly isTypeSupported = () => true
  static readonly made: FakeRecorder[] = []
  readonly mimeType = 'video/webm'
  state = 'recording'
  constructor(readonly stream: MediaStream) {
    super()
    FakeRecorder.made.push(this)
  }
  start(): void {}
  stop(): void {
    this.state = 'inactive'
    this.dispatchEvent(Object.assign(new Event('dataavailable'), { data: new Blob(['picture']) }))
    this.dispatchEvent(new Event('stop'))
  }
}

let store: FakeMedia
let look: (isIntersecting: boolean) => void
let frame: (() => void) | null
let drawn: (MediaProvider | null)[]

beforeEach(() => {
  localStorage.clear()
  store = new FakeMedia()
  frame = null
  drawn = []
  class Observer {
    constructor(listener: (entries: { isIntersecting: boolean }[]) => void) {
      look = (isIntersecting) => act(() => listener([{ isIntersecting }]))
    }
    observe(): void {}
    disconnect(): void {}
  }
  vi.stubGlobal('IntersectionObserver', Observer)
  const video = HTMLVideoElement.prototype as unknown as Record<string, unknown>
  video['requestVideoFrameCallback'] = (callback: (now: number, data: object) => void) => {
    frame = () => callback(0, { rtpTimestamp: 90_000, expectedDisplayTime: 5 })
    return 1
  }
  video['cancelVideoFrameCallback'] = () => {}
  video['play'] = () => Promise.resolve()
  video['videoWidth'] = 640
  video['videoHeight'] = 480
  // HTMLMediaElement.HAVE_CURRENT_DATA
  vi.spyOn(HTMLMediaElement.prototype, 'readyState', 'get').mockReturnValue(2)
  const context = { drawImage: (source: HTMLVideoElement) => drawn.push(source.srcObject) }
  vi.spyOn(HTMLCanvasElement.prototype, 'getContext').mockReturnValue(context as unknown as null)
})

afterEach(() => {
  cleanup()
  vi.useRealTimers()
  vi.unstubAllGlobals()
  vi.restoreAllMocks()
})

function shown(): void {
  render(
    <WithRobot connection={new FakeConnection()}>
      <Video robotId="r" entry={ENTRY} store={store as unknown as AnyStore} />
    </WithRobot>,
  )
}

test('a picture that is not on the screen is not asked for', () => {
  shown()
  expect(store.mediaStream.listenerCount).toBe(1)
  look(false)
  expect(store.mediaStream.listenerCount).toBe(0)
  expect(screen.getByText('Paused')).toBeTruthy()
  look(true)
  expect(store.mediaStream.listenerCount).toBe(1)
})

test('the store hears how large its picture is shown, and whether it leads, also when another one comes or goes', () => {
  vi.useFakeTimers()
  vi.stubGlobal('devicePixelRatio', 2)
  shown()
  const element = screen.getByTestId('video')
  element.getBoundingClientRect = () => new DOMRect(0, 0, 320, 180)
  const lookedAt = () => {
    vi.advanceTimersByTime(250)
    return store.sizes.at(-1)
  }
  expect(lookedAt()).toEqual({ sizePx: 320 * 180 * 4, leads: false })
  const takes = [addPicture('r', element)]
  expect(lookedAt()?.leads).toBe(true)
  const first = document.createElement('div')
  document.body.prepend(first)
  takes.push(addPicture('r', first))
  expect(lookedAt()?.leads).toBe(false)
  takes.forEach((take) => take())
  first.remove()
})

test('the store hears of every displayed picture, and its age stands over it', () => {
  vi.useFakeTimers()
  act(() => store.mediaStream.set(new MediaStream()))
  shown()
  act(() => {
    frame?.()
    frame?.()
    vi.advanceTimersByTime(300)
  })
  expect(store.shown).toEqual([90_000, 90_000])
  expect(screen.getByTestId('picture-facts').textContent).toContain('42 ms old')
})

test('a camera that was refused says why, in the robot’s words where there are some', () => {
  shown()
  act(() => store.state.set({ phase: 'closed', code: 'sdp.no_common_codec' }))
  expect(screen.getByText('Operator and robot share no codec for one of the media lines.')).toBeTruthy()
  expect(screen.getByText(/sdp\.no_common_codec/)).toBeTruthy()
  act(() => store.state.set({ phase: 'closed', code: 'media.no_encoder', message: 'no VP9 here' }))
  expect(screen.getByText('no VP9 here')).toBeTruthy()
  act(() => store.state.set({ phase: 'waiting' }))
  expect(screen.getByText('No picture')).toBeTruthy()
})

test('a camera that shows nothing says why, until a picture comes', async () => {
  vi.useFakeTimers()
  act(() => store.mediaStream.set(new MediaStream()))
  store.arrived = { packets: 0, frames: 0, reportedPackets: 120 }
  shown()
  await act(() => vi.advanceTimersByTimeAsync(7_900))
  expect(screen.queryByText(/media\.no_packets/)).toBeNull()
  await act(() => vi.advanceTimersByTimeAsync(200))
  expect(screen.getByText(/media\.no_packets/)).toBeTruthy()
  act(() => {
    frame?.()
    vi.advanceTimersByTime(300)
  })
  expect(screen.queryByText(/media\.no_packets/)).toBeNull()
})

test('a frozen picture is marked and says since when', () => {
  vi.useFakeTimers()
  act(() => store.mediaStream.set(new MediaStream()))
  shown()
  act(() => {
    frame?.()
    vi.advanceTimersByTime(2000)
  })
  expect(screen.getByTestId('video').dataset['state']).toBe('stale')
  expect(screen.getByRole('alert').textContent).toMatch(/Picture frozen for [12]\.\d s/)
})

function played(): MediaStream {
  const stream = new MediaStream()
  act(() => store.mediaStream.set(stream))
  act(() => {
    frame?.()
    vi.advanceTimersByTime(300)
  })
  return stream
}

function lost(): void {
  act(() => {
    store.mediaStream.set(null)
    store.state.set({ phase: 'reconnecting', code: 'peer.lost' })
  })
}

test('while the connection is away the last picture stays, until there is another one', () => {
  vi.useFakeTimers()
  shown()
  const before = played()
  expect(screen.queryByTestId('kept-picture')).toBeNull()
  lost()
  expect(screen.getByTestId('video').dataset['state']).toBe('reconnecting')
  expect(screen.getByTestId('kept-picture').querySelector('canvas')).not.toBeNull()
  expect(screen.queryByText('No picture')).toBeNull()
  expect(drawn).toEqual([before])
  act(() => {
    store.state.set({ phase: 'open' })
    store.mediaStream.set(new MediaStream())
    vi.advanceTimersByTime(600)
  })
  expect(screen.getByTestId('kept-picture')).toBeTruthy()
  expect(screen.getByText('No picture yet')).toBeTruthy()
  act(() => {
    frame?.()
    vi.advanceTimersByTime(300)
  })
  expect(screen.queryByTestId('kept-picture')).toBeNull()
})

test('once the robot was left its last picture is gone for good', () => {
  vi.useFakeTimers()
  shown()
  played()
  lost()
  act(() => store.state.set({ phase: 'closed' }))
  expect(screen.queryByTestId('kept-picture')).toBeNull()
  act(() => store.state.set({ phase: 'reconnecting' }))
  expect(screen.queryByTestId('kept-picture')).toBeNull()
  expect(screen.getByText('No picture')).toBeTruthy()
})

test('a picture that left the screen before the connection went is kept as well', () => {
  vi.useFakeTimers()
  shown()
  played()
  look(false)
  lost()
  look(true)
  expect(screen.getByTestId('kept-picture')).toBeTruthy()
})

test('where nothing was shown, nothing is kept', () => {
  vi.useFakeTimers()
  vi.spyOn(HTMLMediaElement.prototype, 'readyState', 'get').mockReturnValue(1)
  shown()
  act(() => store.mediaStream.set(new MediaStream()))
  lost()
  expect(screen.queryByTestId('kept-picture')).toBeNull()
  expect(screen.getByText('No picture')).toBeTruthy()
})

test('pictures are buffered for driving unless somebody chooses otherwise', async () => {
  shown()
  expect(store.targets).toEqual([0])
  await userEvent.click(screen.getByRole('button', { name: 'More for front' }))
  await userEvent.click(await screen.findByRole('menuitem', { name: /^Inspect/ }))
  expect(store.targets.at(-1)).toBe(250)
})

async function recorded(): Promise<FakeRecorder> {
  FakeRecorder.made.length = 0
  vi.stubGlobal('MediaRecorder', FakeRecorder)
  vi.spyOn(HTMLAnchorElement.prototype, 'click').mockImplementation(() => {})
  vi.useFakeTimers({ shouldAdvanceTime: true })
  act(() => store.mediaStream.set(new MediaStream()))
  shown()
  act(() => {
    frame?.()
    vi.advanceTimersByTime(300)
  })
  await userEvent.click(screen.getByRole('button', { name: 'Record here, in this browser' }))
  const [recorder] = FakeRecorder.made
  if (recorder === undefined) throw new Error('nothing was recorded')
  return recorder
}

test('a picture that is being recorded comes on while it is scrolled away, until the recording is ended', async () => {
  const recorder = await recorded()
  look(false)
  expect(recorder.state).toBe('recording')
  expect(store.mediaStream.listenerCount).toBeGreaterThan(0)
  expect(store.isKept).toBe(true)
  expect(screen.queryByText('Paused')).toBeNull()
  await userEvent.click(screen.getByRole('button', { name: 'End the recording and save it' }))
  expect(recorder.state).toBe('inactive')
  expect(store.mediaStream.listenerCount).toBe(0)
  expect(store.isKept).toBe(false)
  expect(screen.queryByText(/and the recording with it/)).toBeNull()
})

test('a recording that ends with the picture says so', async () => {
  const recorder = await recorded()
  act(() => store.mediaStream.set(null))
  expect(recorder.state).toBe('inactive')
  expect(screen.getByText(/The picture ended, and the recording with it/)).toBeTruthy()
  expect(store.isKept).toBe(false)
})

test('a recorder that stops by itself says so', async () => {
  const recorder = await recorded()
  act(() => recorder.stop())
  expect(screen.getByText(/The picture ended, and the recording with it/)).toBeTruthy()
  expect(screen.getByRole('button', { name: 'Record here, in this browser' })).toBeTruthy()
})

test('the saved figures count their seconds on over a picture that came anew', async () => {
  const saved: Blob[] = []
  vi.spyOn(URL, 'createObjectURL').mockImplementation((blob) => `blob:${saved.push(blob as Blob)}`)
  vi.spyOn(HTMLAnchorElement.prototype, 'click').mockImplementation(() => {})
  vi.useFakeTimers({ shouldAdvanceTime: true })
  shown()
  for (const stream of [new MediaStream(), null, new MediaStream()]) {
    act(() => store.mediaStream.set(stream))
    act(() => void vi.advanceTimersByTime(2000))
  }
  await userEvent.click(screen.getByRole('button', { name: 'More for front' }))
  await userEvent.click(await screen.findByRole('menuitem', { name: 'Save as CSV' }))
  const [, ...rows] = ((await saved[0]?.text()) ?? '').trim().split('\r\n')
  const seconds = rows.map((row) => Number(row.split(',')[0]))
  expect(seconds).toHaveLength(4)
  expect(seconds).toEqual([...seconds].sort((a, b) => a - b))
  expect(seconds.at(-1)).toBeGreaterThan(4)
})

test('all figures are shown on demand', async () => {
  act(() => store.mediaStream.set(new MediaStream()))
  shown()
  await userEvent.click(screen.getByRole('button', { name: 'Show all figures' }))
  expect(screen.getByRole('button', { name: 'Hide the figures' }).getAttribute('aria-pressed')).toBe('true')
  expect(screen.getByTestId('picture-facts').dataset['details']).toBe('true')
})
