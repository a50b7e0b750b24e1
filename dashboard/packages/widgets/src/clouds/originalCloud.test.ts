// @vitest-environment node
import { expect, test } from 'vitest'
import { CloudError } from './inflated'
import { OriginalClouds } from './originalCloud'

const varint = (value: number): number[] => (value < 128 ? [value] : [(value % 128) + 128, ...varint(Math.floor(value / 128))])
const number = (field: number, value: number) => (value === 0 ? [] : [...varint(field * 8), ...varint(value)])
const bytes = (field: number, value: readonly number[]) => [...varint(field * 8 + 2), ...varint(value.length), ...value]
const text = (field: number, value: string) => bytes(field, [...new TextEncoder().encode(value)])
const time = [1 * 8 + 1, ...new Uint8Array(8)]
const message = (...parts: readonly (readonly number[])[]) => new Uint8Array(parts.flat()).buffer

const FIELDS = ['x', 'y', 'z', 'intensity']
const pointField = (name: string, index: number) => [...text(1, name), ...number(2, 4 * index), ...number(3, 7), ...number(4, 1)]
function meta({ points = 4, chunks = 2, isBig = false, isOlder = false, names = FIELDS } = {}) {
  const described = names.map((name, index) => bytes(isOlder ? 15 : 16, pointField(name, index)))
  const size = [number(3, 1), number(4, points), number(5, isBig ? 1 : 0), number(6, 4 * names.length)]
  return message(time, text(2, 'f'), ...size, ...(isOlder ? [] : [number(15, chunks)]), ...described)
}
function chunk(index: number, points: readonly (readonly number[])[], { frame = 'f', isBig = false } = {}) {
  const view = new DataView(new ArrayBuffer(4 * points.flat().length))
  points.flat().forEach((value, at) => view.setFloat32(4 * at, value, !isBig))
  return message(time, text(2, frame), number(3, index), number(4, points.length), bytes(5, [...new Uint8Array(view.buffer)]))
}
const LOW = [[1, 2, 3, 0], [4, 5, 6, 10]] // prettier-ignore
const HIGH = [[7, 8, 9, 20], [10, 11, 12, 40]] // prettier-ignore

test('a cloud is shown when all but one chunk have come, and again with the rest', () => {
  const clouds = new OriginalClouds()
  expect(clouds.take(meta())).toBeNull()
  expect(clouds.take(chunk(0, LOW))?.count).toBe(2)
  const whole = clouds.take(chunk(1, HIGH))
  expect([...(whole?.positions ?? [])]).toEqual([1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12])
  expect([[...(whole?.intensities ?? [])], whole?.intensityRange]).toEqual([[0, 64, 128, 255], [0, 40]])
})

test('coordinates are read in the order of bytes that the robot says, with or without an intensity', () => {
  const clouds = new OriginalClouds()
  clouds.take(meta({ isBig: true, points: 1, chunks: 1, names: ['x', 'y', 'z'] }))
  const cloud = clouds.take(chunk(0, [[1.5, -2, 0.25]], { isBig: true }))
  expect([...(cloud?.positions ?? []), cloud?.intensities]).toEqual([1.5, -2, 0.25, null])
})

test('robots that announce no number of chunks have a cloud when all its points have come', () => {
  const clouds = new OriginalClouds()
  clouds.take(meta({ isOlder: true }))
  expect(clouds.take(chunk(0, LOW))).toBeNull()
  expect(clouds.take(chunk(1, HIGH))?.count).toBe(4)
})

test('chunks of another cloud, before any, or without points change nothing', () => {
  const clouds = new OriginalClouds()
  expect(clouds.take(chunk(0, LOW))).toBeNull()
  clouds.take(meta({ chunks: 1 }))
  expect(clouds.take(chunk(0, LOW, { frame: 'older' }))).toBeNull()
  expect(clouds.take(chunk(1, []))).toBeNull()
})

test.each([
  ['text', new TextEncoder().encode('not a cloud').buffer],
  ['a message that ends early', meta().slice(0, 60)],
  ['points without coordinates', meta({ names: ['a', 'b', 'c'] })],
])('%s is no cloud', (_, data) => {
  expect(() => new OriginalClouds().take(data)).toThrow(CloudError)
})
