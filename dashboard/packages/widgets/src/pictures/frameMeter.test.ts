import { expect, test } from 'vitest'
import { FrameMeter } from './frameMeter'
import { detailsText, formattedBitrate, pictureText, type PictureFacts } from './pictureText'

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

const NOTHING: PictureFacts = { state: 'live', ages: null, framesPerSecond: null, widthPx: 0, heightPx: 0, roundTripMs: null, statistics: null }
const ALL: PictureFacts = {
  state: 'live',
  ages: { p50Ms: 41.6, p95Ms: 63 },
  framesPerSecond: 29.97,
  widthPx: 640,
  heightPx: 480,
  roundTripMs: 12.4,
  statistics: {
    widthPx: 640,
    heightPx: 480,
    framesPerSecond: 30,
    bitrateBps: 1_540_000,
    framesDropped: 1,
    packetsLost: 7,
    lossShare: 0.012,
    freezes: 2,
    bufferMs: 20.4,
    jitterMs: 3.2,
    codec: 'video/VP8',
  },
}

test('what is not known is left out of the line', () => {
  expect(pictureText(NOTHING)).toBe('')
  expect(pictureText(ALL)).toBe('42 ms old · 30 fps · 640×480 · 1.5 Mbit/s')
})

test('a frozen picture has no age that it once had', () => {
  expect(pictureText({ ...ALL, state: 'stale' })).not.toContain('old')
  expect(detailsText({ ...ALL, state: 'stale' })).toContain('not known')
})

test('the details name everything that is measured', () => {
  expect(detailsText(ALL).split('\n')).toEqual([
    'Age (glass to glass): 42 ms, 95 % below 63 ms',
    'Picture: 640×480, 30.0 fps',
    'Bit rate: 1.5 Mbit/s, VP8',
    'Loss: 1.2 %, 7 packets in all',
    'Freezes: 2, dropped: 1',
    'Buffered: 20 ms, jitter 3.2 ms',
    'Round trip: 12 ms',
  ])
})

test('bit rates are short', () => {
  expect(formattedBitrate(1_540_000)).toBe('1.5 Mbit/s')
  expect(formattedBitrate(380_400)).toBe('380 kbit/s')
})
