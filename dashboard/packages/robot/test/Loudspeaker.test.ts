import { afterEach, beforeEach, expect, test, vi } from 'vitest'
import { timerTicks } from '../../client/src/timing/Ticks'
import { Loudspeaker } from '../src/connectors/Loudspeaker'

let stopped = false
const told = vi.fn()
const players = new Map<string, { isMuted: boolean; isEnded: boolean }>()

beforeEach(() => {
  vi.useFakeTimers()
  stopped = false
  told.mockClear()
  players.clear()
})

afterEach(() => {
  vi.useRealTimers()
})

function loudspeaker(): Loudspeaker {
  const play = (track: MediaStreamTrack) => {
    const player = { isMuted: false, isEnded: false }
    players.set(track.id, player)
    return { mute: (isMuted: boolean) => void (player.isMuted = isMuted), end: () => void (player.isEnded = true) }
  }
  return new Loudspeaker({ now: () => performance.now(), ticks: timerTicks }, play, told, () => stopped)
}

/** Somebody whose voice sends packets while `isTalking`. */
function voice(speaker: Loudspeaker, id: string, mayTalk = true) {
  const person = { id, mayTalk, isTalking: false, talkRefused: vi.fn() }
  let packets = 0
  const getStats = () => {
    packets += person.isTalking ? 5 : 0
    return Promise.resolve(new Map([['in', { type: 'inbound-rtp', packetsReceived: packets }]]))
  }
  speaker.add(person, { id } as MediaStreamTrack, { getStats } as unknown as RTCRtpReceiver)
  return person
}

test('the first who talks is heard, everybody is told, and the next one in turn', async () => {
  const speaker = loudspeaker()
  const [ada, bob] = [voice(speaker, 'ada'), voice(speaker, 'bob')]
  ada.isTalking = true
  await vi.advanceTimersByTimeAsync(150)
  expect(told.mock.calls).toEqual([['ada']])
  expect(players.get('ada')?.isMuted).toBe(false)
  bob.isTalking = true
  await vi.advanceTimersByTimeAsync(300)
  expect(bob.talkRefused.mock.calls).toEqual([['loudspeaker', 'media.talk_busy']])
  expect(players.get('bob')?.isMuted).toBe(true)
  ada.isTalking = false
  await vi.advanceTimersByTimeAsync(800)
  expect(speaker.talking).toBe('bob')
  expect(players.get('ada')?.isMuted).toBe(true)
})

test('an observer is never heard', async () => {
  const speaker = loudspeaker()
  const eve = voice(speaker, 'eve', false)
  eve.isTalking = true
  await vi.advanceTimersByTimeAsync(300)
  expect(eve.talkRefused.mock.calls).toEqual([['loudspeaker', 'lease.forbidden']])
  expect(speaker.talking).toBeNull()
})

test('a stop silences it, and who leaves is silent in the middle of a word', async () => {
  const speaker = loudspeaker()
  voice(speaker, 'ada').isTalking = true
  await vi.advanceTimersByTimeAsync(150)
  stopped = true
  await vi.advanceTimersByTimeAsync(150)
  expect(players.get('ada')?.isMuted).toBe(true)
  stopped = false
  await vi.advanceTimersByTimeAsync(150)
  expect(speaker.talking).toBe('ada')
  speaker.remove('ada')
  expect(speaker.talking).toBeNull()
  expect(players.get('ada')?.isEnded).toBe(true)
  expect(vi.getTimerCount()).toBe(0)
})
