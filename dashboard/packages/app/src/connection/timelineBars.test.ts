import fc from 'fast-check'
import { MOMENT_TITLES, type Timeline } from '@mosaic/client'
import { expect, test } from 'vitest'
import { timelineBars } from './timelineBars'

const MOMENTS = Object.keys(MOMENT_TITLES) as (keyof typeof MOMENT_TITLES)[]

test('each bar begins where the one before ended; the end of a failure is a bar of its own', () => {
  const timeline: Timeline = {
    marks: [
      { moment: 'asked', atMs: 0, detail: '' },
      { moment: 'granted', atMs: 1_000, detail: '' },
    ],
    code: 'ice.timeout',
    endedMs: 10_000,
  }
  const [asked, granted, ended] = timelineBars(timeline)
  expect(asked).toMatchObject({ title: MOMENT_TITLES.asked, at: '0 ms' })
  expect(granted).toMatchObject({ startPercent: 0, widthPercent: 10 })
  expect(ended).toMatchObject({ title: 'Ended', detail: 'ice.timeout', at: '10.0 s', startPercent: 10, widthPercent: 90, isEnd: true })
})

test('an end on purpose is no failure', () => {
  expect(timelineBars({ marks: [], code: 'peer.closed', endedMs: 5 })).toEqual([])
})

test('no bar leaves its track', () => {
  const mark = fc.record({ moment: fc.constantFrom(...MOMENTS), atMs: fc.double({ min: 0, max: 1e6, noNaN: true }), detail: fc.string() })
  fc.assert(
    fc.property(fc.array(mark), fc.double({ min: 0, max: 1e6, noNaN: true }), (marks, endedMs) => {
      const sorted = [...marks].sort((one, other) => one.atMs - other.atMs)
      const bars = timelineBars({ marks: sorted, code: 'ice.failed', endedMs: Math.max(endedMs, sorted.at(-1)?.atMs ?? 0) })
      return bars.every(({ startPercent, widthPercent }) => startPercent >= 0 && widthPercent > 0 && startPercent + widthPercent <= 100.001)
    }),
  )
})
