import { beforeEach, expect, test } from 'vitest'
import { NO_SECURE_CONTEXT } from './microphoneProblem'
import { TalkSession } from './TalkSession'

class FakeTrack extends EventTarget {
  isStopped = false
  stop = () => {
    this.isStopped = true
  }
}

let track: FakeTrack
let given: { resolve: () => void; reject: (error: unknown) => void }
let sent: (object | null)[]
let isOpen: boolean
let page: EventTarget
let documentLike: EventTarget & { visibilityState: DocumentVisibilityState }
let session: TalkSession

const settled = () => new Promise((resolve) => setTimeout(resolve))

function made(hasMicrophone = true): TalkSession {
  return new TalkSession({
    getUserMedia: hasMicrophone
      ? () =>
          new Promise((resolve, reject) => {
            const stream = { getAudioTracks: () => [track], getTracks: () => [track] }
            given = { resolve: () => resolve(stream as unknown as MediaStream), reject }
          })
      : undefined,
    setTrack: (next) => {
      sent.push(next)
      return Promise.resolve(isOpen)
    },
    page: page,
    document: documentLike,
  })
}

beforeEach(() => {
  track = new FakeTrack()
  sent = []
  isOpen = true
  page = new EventTarget()
  documentLike = Object.assign<EventTarget, { visibilityState: DocumentVisibilityState }>(new EventTarget(), { visibilityState: 'visible' })
  session = made()
})

async function talking(): Promise<void> {
  session.begin()
  expect(session.phase.get()).toBe('asking')
  given.resolve()
  await settled()
  expect(session.phase.get()).toBe('talking')
  expect(sent).toEqual([track])
}

function expectEnded(): void {
  expect(session.phase.get()).toBe('silent')
  expect(sent.at(-1)).toBeNull()
  expect(track.isStopped).toBe(true)
}

test('held it talks, released it is silent and gives the microphone back', async () => {
  await talking()
  session.end()
  expectEnded()
})

test('a microphone that comes after the release is given back unheard', async () => {
  session.begin()
  session.end()
  given.resolve()
  await settled()
  expect(sent).toEqual([])
  expect(track.isStopped).toBe(true)
  expect(session.phase.get()).toBe('silent')
})

test('a page that loses the focus or is hidden ends the talk', async () => {
  await talking()
  page.dispatchEvent(new Event('blur'))
  expectEnded()
  sent = []
  await talking()
  documentLike.visibilityState = 'hidden'
  documentLike.dispatchEvent(new Event('visibilitychange'))
  expectEnded()
})

test('a page that is shown again does not', async () => {
  await talking()
  documentLike.dispatchEvent(new Event('visibilitychange'))
  expect(session.phase.get()).toBe('talking')
})

test('a microphone that is unplugged ends the talk', async () => {
  await talking()
  track.dispatchEvent(new Event('ended'))
  expectEnded()
})

test('a page without a secure context says so', () => {
  session = made(false)
  session.begin()
  expect(session.problem.get()).toBe(NO_SECURE_CONTEXT)
  expect(session.phase.get()).toBe('silent')
})

test.each([
  ['NotAllowedError', 'Allow it'],
  ['NotFoundError', 'Plug one in'],
  ['NotReadableError', 'another program'],
  ['OddError', 'odd'],
])('%s is told in words, and the next press asks anew', async (name, words) => {
  session.begin()
  given.reject(new DOMException('odd', name))
  await settled()
  expect(session.problem.get()).toContain(words)
  expect(session.phase.get()).toBe('silent')
  await talking()
  expect(session.problem.get()).toBe('')
})

test('without a connection it says so and holds no microphone', async () => {
  isOpen = false
  session.begin()
  given.resolve()
  await settled()
  expect(session.problem.get()).toBe('Not connected to the robot.')
  expectEnded()
})

test('disposed it is silent and hears the page no more', async () => {
  await talking()
  session.dispose()
  expectEnded()
  sent = []
  page.dispatchEvent(new Event('blur'))
  expect(sent).toEqual([])
})
