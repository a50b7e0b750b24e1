import { afterEach, expect, test, vi } from 'vitest'
import { START } from './camera'
import { CloudDecoder, type DecodedCloud, type DecoderWorker } from './CloudDecoder'
import { extentOf, followed } from './cloudExtent'
import { factsText, Rate } from './cloudText'
import type { PointCloud } from '../clouds/compactCloud'
import { gridLines } from './gridLines'
import { moveOfKey } from './CameraControls'
import { rgbOf } from './rgbOf'

afterEach(() => void vi.unstubAllGlobals())

function cloudOf(points: number[][], origin: [number, number, number] = [0, 0, 0]): PointCloud {
  const positions = Float32Array.from(points.flat())
  const rest = { intensities: null, intensityRange: [0, 0], colours: null, frameId: '', capturedUs: 0, resolutionM: 0.01 } as const
  return { count: points.length, positions, origin, ...rest }
}

test('a few far-off points do not move the view', () => {
  const room = Array.from({ length: 200 }, (_, index) => [index % 10, Math.floor(index / 20), 1])
  const extent = extentOf(cloudOf([...room, [9000, 0, 0]], [100, 0, 0]))
  expect(extent.center[0]).toBeCloseTo(104.5)
  expect(extent.radiusM).toBeLessThan(10)
  expect(extent.height).toEqual([1, 1])
  expect(extentOf(cloudOf([])).radiusM).toBe(0)
})

test('colours follow a changing range slowly', () => {
  expect(followed(null, [0, 2])).toEqual([0, 2])
  const next = followed([0, 2], [1, 10])
  expect(next[0]).toBeGreaterThan(0)
  expect(next[1]).toBeLessThan(4)
})

test('the foot tells points, rate, size and age', () => {
  expect(factsText({ points: 98304, bytes: 123_904, rateHz: 9.96, ageMs: 45.4 })).toBe('98,304 points · 10.0 Hz · 121 KB · 45 ms')
  expect(factsText({ points: 0, bytes: 60, rateHz: null, ageMs: null })).toBe('0 points · 60 B')
  expect(factsText({ points: 1, bytes: 3_500_000, rateHz: 0.5, ageMs: 2300 })).toBe('1 points · 0.5 Hz · 3.3 MB · 2.3 s')
})

test('the rate is that of the last seconds', () => {
  const rate = new Rate()
  expect(rate.rateHz).toBeNull()
  for (let atMs = 0; atMs <= 20_000; atMs += 100) rate.note(atMs)
  expect(rate.rateHz).toBeCloseTo(10)
  for (let atMs = 20_500; atMs <= 30_000; atMs += 500) rate.note(atMs)
  expect(rate.rateHz).toBeCloseTo(2)
})

test('the grid follows the camera in whole steps', () => {
  const near = gridLines(START, [0, 0, 0])
  expect(near.key).toBe(gridLines({ ...START, yawRad: 1, target: [0.1, 0, 0] }, [0, 0, 0]).key)
  expect(near.key).not.toBe(gridLines({ ...START, distanceM: 100 }, [0, 0, 0]).key)
  expect(near.key).not.toBe(gridLines(START, [1, 1, 1]).key)
  expect(near.vertices().length % 14).toBe(0)
})

test('keys turn, move, zoom and fit; all others stay the page’s', () => {
  const apply = (key: string, isShifted = false) => {
    const move = moveOfKey(key, isShifted)
    return typeof move === 'function' ? move(START) : move
  }
  expect(apply('ArrowLeft')).toMatchObject({ target: START.target })
  expect(apply('ArrowUp', true)).not.toMatchObject({ target: START.target })
  expect(apply('+')).toMatchObject({ yawRad: START.yawRad })
  expect([apply('f'), apply('w'), apply(' '), apply('Escape')]).toEqual(['fit', null, null, null])
})

test('colours of the page are read, others are grey', () => {
  expect(rgbOf(' #ff0080 ')).toEqual([1, 0, 128 / 255])
  expect(rgbOf('rgb(1 2 3)')).toEqual([0.5, 0.5, 0.5])
})

class FakeWorker implements DecoderWorker {
  asked: { id: number; data: ArrayBuffer }[] = []
  onmessage: DecoderWorker['onmessage'] = null
  onerror: DecoderWorker['onerror'] = null
  isTerminated = false
  postMessage(message: { id: number; data: ArrayBuffer }): void {
    this.asked.push(message)
  }
  terminate(): void {
    this.isTerminated = true
  }
  answer(decoded: DecodedCloud): void {
    this.onmessage?.call(this as unknown as Worker, { data: decoded } as MessageEvent)
  }
}

function decoding() {
  const worker = new FakeWorker()
  const shown: string[] = []
  const problems: string[] = []
  const decoder = new CloudDecoder<string>((_, tag) => shown.push(tag), (problem) => problems.push(problem), () => worker)
  return { worker, shown, problems, decoder }
}

const LARGE = new ArrayBuffer(100)
new DataView(LARGE).setUint32(8, 100_000)

test('while one cloud is decoded only the newest of the others waits', () => {
  const { worker, shown, problems, decoder } = decoding()
  for (const tag of ['a', 'b', 'c', 'd']) decoder.take(LARGE, tag)
  expect(worker.asked.length).toBe(1)
  worker.answer({ id: 1, cloud: cloudOf([]) })
  expect(shown).toEqual(['a'])
  worker.answer({ id: 2, problem: 'broken' })
  expect([shown, problems]).toEqual([['a'], ['broken']])
  decoder.take(LARGE, 'e')
  worker.answer({ id: 3, cloud: cloudOf([]) })
  expect(shown).toEqual(['a', 'e'])
  decoder.dispose()
  expect(worker.isTerminated).toBe(true)
})

test('small clouds, and all where no worker may run, are decoded here', async () => {
  const { worker, problems, decoder } = decoding()
  decoder.take(new ArrayBuffer(3), 'small')
  await vi.waitFor(() => expect(problems).toEqual(['shorter than its header']))
  decoder.take(LARGE, 'large')
  worker.onerror?.call(worker as unknown as Worker, new Event('error') as ErrorEvent)
  await vi.waitFor(() => expect(problems.length).toBe(2))
  decoder.take(LARGE, 'large')
  await vi.waitFor(() => expect(problems.length).toBe(3))
  expect(worker.asked.length).toBe(1)
})
