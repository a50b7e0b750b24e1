import { expect, test } from 'vitest'
import { FrameMeter } from './frameMeter'
import { formattedBitrate, pictureText } from './pictureText'

function fed(periodMs: number, count: number): { meter: FrameMeter; lastMs: number } {
  const meter = new FrameMeter()
  for (let index = 0; index < count; index++) meter.add(index * periodMs)
  return { meter, lastMs: (count - 1) * periodMs }
}

test('pictures are counted over two seconds', () => {
  const { meter, lastMs } = fed(50, 60)
  expect(meter.framesPerSecond(lastMs)).toBeCloseTo(20)
})

test('before the first picture there is none', () => {
  const meter = new FrameMeter()
  expect(meter.state(0)).toBe('none')
  expect(meter.framesPerSecond(0)).toBeNull()
  expect(meter.ageMs(0)).toBeNull()
})

test('a picture that stays is frozen after a second', () => {
  const { meter, lastMs } = fed(33, 60)
  expect(meter.state(lastMs + 900)).toBe('live')
  expect(meter.state(lastMs + 1100)).toBe('stale')
  expect(meter.ageMs(lastMs + 1100)).toBe(1100)
})

test('a camera with one picture a second is not frozen between two', () => {
  const { meter, lastMs } = fed(1000, 5)
  expect(meter.state(lastMs + 1500)).toBe('live')
  expect(meter.state(lastMs + 3500)).toBe('stale')
})

test('a new stream starts anew', () => {
  const { meter } = fed(33, 10)
  meter.reset()
  expect(meter.state(0)).toBe('none')
})

test('what is not known is left out of the line', () => {
  const nothing = { framesPerSecond: null, widthPx: 0, heightPx: 0, roundTripMs: null, pictureAgeMs: null, statistics: null }
  expect(pictureText(nothing)).toBe('')
  expect(pictureText({ ...nothing, framesPerSecond: 29.97, widthPx: 640, heightPx: 480, roundTripMs: 12.4, pictureAgeMs: 41.6 })).toBe(
    '30 fps · 640×480 · age 42 ms · rtt 12 ms',
  )
})

test('bit rates are short', () => {
  expect(formattedBitrate(1_540_000)).toBe('1.5 Mbit/s')
  expect(formattedBitrate(380_400)).toBe('380 kbit/s')
})
