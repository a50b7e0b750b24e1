import type { MediaStatistics } from '@mosaic/client'
import fc from 'fast-check'
import { expect, test } from 'vitest'
import { PictureAges, quantile } from './pictureAges'
import { csvOf, jsonOf, recordOf } from './pictureRecords'

const STATISTICS: MediaStatistics = {
  widthPx: 640,
  heightPx: 480,
  framesPerSecond: 30,
  bitrateBps: 1_234_567.8,
  framesDropped: 1,
  packetsLost: 4,
  lossShare: 0.01234,
  freezes: 2,
  bufferMs: 12.34,
  jitterMs: 3.21,
  codec: 'video/VP8',
}

test('the median is of the last second only', () => {
  const ages = new PictureAges()
  ages.add(0, 900)
  for (let index = 1; index <= 30; index++) ages.add(1000 + index * 33, 40 + index)
  expect(ages.summary(2000)).toEqual({ p50Ms: 55, p95Ms: 69 })
  expect(ages.summary(9000)).toBeNull()
})

test('a quantile is one of the numbers, and grows with the share', () => {
  fc.assert(
    fc.property(fc.array(fc.nat(1000), { minLength: 1 }), fc.double({ min: 0, max: 1, noNaN: true }), (numbers, share) => {
      const sorted = numbers.toSorted((one, other) => one - other)
      expect(sorted).toContain(quantile(sorted, share))
      expect(quantile(sorted, share)).toBeLessThanOrEqual(quantile(sorted, 1))
      expect(sorted.filter((number) => number <= quantile(sorted, share)).length).toBeGreaterThanOrEqual(share * sorted.length)
    }),
  )
})

test('a record has what was measured, and null for what was not', () => {
  const full = recordOf(1.234, { state: 'live', ages: { p50Ms: 41.27, p95Ms: 60 }, framesPerSecond: 29.97, roundTripMs: 8, statistics: STATISTICS })
  expect(full).toMatchObject({ t_s: 1.23, age_p50_ms: 41.3, fps: 30, bitrate_bps: 1234568, loss: 0.0123, freezes: 2, buffer_ms: 12.3 })
  const empty = recordOf(0, { state: 'none', ages: null, framesPerSecond: null, roundTripMs: null, statistics: null })
  expect(Object.values(empty).filter((value) => value !== null)).toEqual([0, 'none'])
})

test('exported as CSV every line has every column', () => {
  const record = recordOf(2, { state: 'live', ages: null, framesPerSecond: 15, roundTripMs: null, statistics: STATISTICS })
  const lines = csvOf([record, record]).split('\r\n')
  expect(lines).toHaveLength(4)
  expect(new Set(lines.slice(0, 3).map((line) => line.split(',').length))).toEqual(new Set([16]))
  expect(lines[1]).toBe('2,live,,,15,640,480,1234568,0.0123,4,2,1,3.2,12.3,,video/VP8')
})

test('exported as JSON it says which picture it is of', () => {
  expect(JSON.parse(jsonOf('front', []))).toEqual({ label: 'front', records: [] })
})
