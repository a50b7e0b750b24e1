import { afterEach, beforeEach, expect, test, vi } from 'vitest'
import { GATHER_TIMEOUT_MS, gatherIce } from '../../src/diagnosis/gatherIce'
import { hasAnswered } from '../../src/diagnosis/iceAnswers'
import { FakePlatform } from '../fakes'

const STUN: RTCIceServer = { urls: ['stun:stun.example.org'] }

beforeEach(() => void vi.useFakeTimers({ toFake: ['setTimeout', 'clearTimeout', 'performance', 'Date'] }))
afterEach(() => void vi.useRealTimers())

test('a server that sees the own address of this machine lets the browser finish at once', async () => {
  const platform = new FakePlatform()
  const gathering = gatherIce(platform, [STUN])
  await vi.advanceTimersByTimeAsync(40)
  platform.peer.finds('')
  const answer = await gathering
  expect(answer).toMatchObject({ url: 'stun:stun.example.org', endedMs: 40 })
  expect(hasAnswered(answer)).toBe(true)
  expect(platform.peer.isClosed).toBe(true)
})

test('of a dead one the browser says nothing within the time', async () => {
  const platform = new FakePlatform()
  const gathering = gatherIce(platform, [STUN])
  await vi.advanceTimersByTimeAsync(GATHER_TIMEOUT_MS)
  const answer = await gathering
  expect(answer).not.toHaveProperty('endedMs')
  expect(hasAnswered(answer)).toBe(false)
})

test('what the browser refuses is its fault, in its words', async () => {
  const platform = new FakePlatform()
  vi.spyOn(platform, 'openPeerConnection').mockImplementation(() => {
    throw new DOMException('Both username and credential are required', 'InvalidAccessError')
  })
  expect(await gatherIce(platform, [STUN])).toMatchObject({ fault: 'Both username and credential are required' })
})

test('an offer that can not be made is told too, and the connection closed', async () => {
  const platform = new FakePlatform()
  const open = platform.openPeerConnection.bind(platform)
  vi.spyOn(platform, 'openPeerConnection').mockImplementation((configuration) => {
    const connection = open(configuration)
    vi.spyOn(connection, 'createOffer').mockRejectedValue(new Error('no offer'))
    return connection
  })
  expect((await gatherIce(platform, [STUN])).fault).toBe('no offer')
  expect(platform.peer.isClosed).toBe(true)
})
