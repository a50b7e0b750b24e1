import { Value, type CatalogueEntry, type Refusal, type StoreState, type Talker } from '@mosaic/client'
import { act, cleanup, fireEvent, render, screen } from '@testing-library/react'
import { afterEach, beforeEach, expect, test, vi } from 'vitest'
import { FakeConnection, WithRobot } from '../../test/fakeRobot'
import type { AnyStore } from '../stores/storeKinds'
import { PushToTalk } from './PushToTalk'
import { talkText, type TalkView } from './talkText'

const ENTRY: CatalogueEntry = {
  label: 'horn',
  type: 'speaker',
  kind: 'audio',
  dataType: 'media',
  direction: 'to-robot',
  channels: [],
  delivery: 'latest',
}

class FakeTalk {
  readonly state = new Value<StoreState>({ phase: 'open' })
  readonly talker = new Value<Talker | null>(null)
  readonly lastRefusal = new Value<Refusal | null>(null)
  readonly tracks: (object | null)[] = []
  setTrack(track: MediaStreamTrack | null): Promise<boolean> {
    this.tracks.push(track)
    return Promise.resolve(true)
  }
}

let store: FakeTalk
let track: { stop: () => void; addEventListener: () => void }
const button = (): HTMLButtonElement => screen.getByRole<HTMLButtonElement>('button', { name: 'Hold to talk to horn' })
const settled = () => act(() => new Promise<void>((resolve) => setTimeout(resolve)))

beforeEach(() => {
  store = new FakeTalk()
  track = { stop: vi.fn(), addEventListener: () => {} }
  const stream = { getAudioTracks: () => [track], getTracks: () => [track] }
  vi.stubGlobal('navigator', Object.assign(Object.create(navigator), { mediaDevices: { getUserMedia: () => Promise.resolve(stream) } }))
  HTMLElement.prototype.setPointerCapture = () => {}
  render(
    <WithRobot connection={new FakeConnection()}>
      <PushToTalk robotId="r" entry={ENTRY} store={store as unknown as AnyStore} />
    </WithRobot>,
  )
})

afterEach(() => {
  cleanup()
  vi.unstubAllGlobals()
})

test.each([
  ['a pointer', () => fireEvent.pointerDown(button(), { button: 0 }), () => fireEvent.pointerUp(button())],
  ['the space bar', () => fireEvent.keyDown(button(), { key: ' ' }), () => fireEvent.keyUp(button(), { key: ' ' })],
  ['a pointer that is lost', () => fireEvent.pointerDown(button(), { button: 0 }), () => fireEvent.lostPointerCapture(button())],
  ['a key, until the focus goes', () => fireEvent.keyDown(button(), { key: 'Enter' }), () => fireEvent.blur(button())],
])('the button talks while it is held by %s', async (_, press, release) => {
  press()
  await settled()
  expect(store.tracks).toEqual([track])
  expect(button().getAttribute('aria-pressed')).toBe('true')
  release()
  await settled()
  expect(store.tracks).toEqual([track, null])
  expect(track.stop).toHaveBeenCalled()
  expect(button().getAttribute('aria-pressed')).toBe('false')
})

test('another mouse button and a key that repeats begin nothing', async () => {
  fireEvent.pointerDown(button(), { button: 2 })
  fireEvent.keyDown(button(), { key: ' ', repeat: true })
  fireEvent.keyDown(button(), { key: 'x' })
  await settled()
  expect(store.tracks).toEqual([])
})

test('without a connection the button is off, and a talk ends', async () => {
  fireEvent.keyDown(button(), { key: ' ' })
  await settled()
  act(() => store.state.set({ phase: 'closed' }))
  expect(store.tracks.at(-1)).toBeNull()
  expect(button().disabled).toBe(true)
})

test('it says who else is talking', () => {
  act(() => store.talker.set({ peerId: 'other', name: 'Bob' }))
  expect(screen.getByRole('status').textContent).toBe('Bob is talking')
})

const VIEW: TalkView = { phase: 'silent', problem: '', talker: null, refusal: null, ownPeerId: 'me' }

test.each<[Partial<TalkView>, string]>([
  [{}, 'Nobody is talking'],
  [{ phase: 'asking' }, 'Waiting for the microphone'],
  [{ phase: 'talking' }, 'Speak'],
  [{ phase: 'talking', talker: { peerId: 'me', name: 'Ann' } }, 'You are heard'],
  [{ talker: { peerId: 'you', name: '' } }, 'Somebody is talking'],
  [{ phase: 'talking', refusal: { label: 'horn', code: 'media.talk_busy', message: 'Bob is talking.' } }, 'Not heard: Bob is talking.'],
  [{ phase: 'talking', refusal: { label: 'horn', code: 'media.talk_busy' } }, 'Not heard: Somebody else is talking.'],
  [
    { phase: 'talking', talker: { peerId: 'me', name: 'Ann' }, refusal: { label: 'horn', code: 'media.talk_busy' } },
    'You are heard',
  ],
  [
    { phase: 'talking', talker: { peerId: 'me', name: 'Ann' }, refusal: { label: 'horn', code: 'plugin.no_device', message: 'unplugged' } },
    'Not heard: unplugged',
  ],
  [{ problem: 'No microphone was found.' }, 'No microphone was found.'],
])('of %o it says %s', (view, text) => {
  expect(talkText({ ...VIEW, ...view }).text).toBe(text)
})
