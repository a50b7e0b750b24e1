import { afterEach, beforeEach, expect, test, vi } from 'vitest'
import { remoteAddressIn } from '../../src/peers/chosenPath'
import { NearPath, onPath } from '../../src/peers/NearPath'

const URLS = ['http://rover.local:9002', 'http://10.0.0.7:9002', 'http://[fd00::7]:9002']

beforeEach(() => void vi.useFakeTimers())
afterEach(() => void vi.useRealTimers())

test('the address on the path comes first, and without one nothing is reachable', () => {
  expect(onPath(URLS, '10.0.0.7')).toEqual([URLS[1], URLS[0], URLS[2]])
  expect(onPath(URLS, 'FD00::7')[0]).toBe(URLS[2])
  expect(onPath(URLS, '203.0.113.9')).toEqual([])
  expect(onPath(URLS, '2001:db8::7')).toEqual([])
})

test.each(['fd12::3', 'fe80::1', '192.168.1.9', '172.20.0.1'])('a path to %s is on the same network', (address) => {
  expect(onPath(URLS, address)).toEqual(URLS)
})

const REPORT = [
  { id: 'T', type: 'transport', selectedCandidatePairId: 'P2' },
  { id: 'P1', type: 'candidate-pair', nominated: true, state: 'succeeded', remoteCandidateId: 'R1' },
  { id: 'P2', type: 'candidate-pair', remoteCandidateId: 'R2' },
  { id: 'R1', type: 'remote-candidate', address: '203.0.113.9' },
  { id: 'R2', type: 'remote-candidate', address: '10.0.0.7' },
]

function report(entries: readonly { id: string }[]) {
  return new Map(entries.map((entry) => [entry.id, entry]))
}

test('the selected pair tells the robot’s address; without a transport entry the marked pair does', () => {
  expect(remoteAddressIn(report(REPORT))).toBe('10.0.0.7')
  expect(remoteAddressIn(report(REPORT.slice(1)))).toBe('203.0.113.9')
  expect(remoteAddressIn(report([{ id: 'x' }]))).toBeNull()
})

test('an address that is known only later is found at the second look', async () => {
  const near = new NearPath()
  let address: string | null = null
  near.told(URLS, () => Promise.resolve(address))
  await vi.advanceTimersByTimeAsync(1000)
  expect(near.value.get()).toEqual([])
  address = '10.0.0.7'
  await vi.advanceTimersByTimeAsync(5000)
  expect(near.value.get()[0]).toBe(URLS[1])
})

test('what an old connection still finds out counts no more', async () => {
  const near = new NearPath()
  near.told(URLS, () => Promise.resolve('10.0.0.7'))
  near.forget()
  await vi.advanceTimersByTimeAsync(6000)
  expect(near.value.get()).toEqual([])
  near.told(URLS, () => Promise.reject(new Error('closed')))
  await vi.advanceTimersByTimeAsync(6000)
  expect(near.value.get()).toEqual([])
})

test('a robot that serves no more is offered no more', async () => {
  const near = new NearPath()
  near.told(URLS, () => Promise.resolve('10.0.0.7'))
  await vi.advanceTimersByTimeAsync(1)
  expect(near.value.get()).not.toEqual([])
  near.told([], () => Promise.resolve('10.0.0.7'))
  await vi.advanceTimersByTimeAsync(1)
  expect(near.value.get()).toEqual([])
})
