import { expect, test, vi } from 'vitest'
import fc from 'fast-check'
import { workerPictureTimes, type OriginNews, type PictureLine, type TimesWorker } from '../src/media/pictureTimes'
import { RtpOrigin } from '../src/media/RtpOrigin'

const TWO_32 = 2 ** 32
const PERIOD_MS = 33

function modulo32(ticks: number): number {
  return ((ticks % TWO_32) + TWO_32) % TWO_32
}

function apart(a: number, b: number): number {
  const difference = modulo32(a - b)
  return Math.min(difference, TWO_32 - difference)
}

/** What was told of a stream whose pictures took so long to encode. */
function told(trueOrigin: number, latenciesMs: readonly number[], beginsMs = 1_795_745_352_261): number[] {
  const origin = new RtpOrigin()
  return latenciesMs.flatMap((latencyMs, index) => {
    const capturedMs = beginsMs + index * PERIOD_MS
    return origin.seen(modulo32(Math.round(capturedMs * 90) + trueOrigin), capturedMs + latencyMs) ?? []
  })
}

test('a first picture tells at once, and only quicker ones are news', () => {
  expect(told(0, [40, 12, 60, 15, 12])).toHaveLength(2)
  expect(told(0, [8, 200, 9, 500, 17])).toHaveLength(1)
})

test('the origin is that of the quickest picture, wherever the timestamps begin', () => {
  const latencies = fc.array(fc.integer({ min: 0, max: 2000 }), { minLength: 1, maxLength: 200 })
  fc.assert(
    fc.property(fc.integer({ min: 0, max: TWO_32 - 1 }), latencies, (trueOrigin, latenciesMs) => {
      const last = told(trueOrigin, latenciesMs).at(-1) ?? NaN
      const quickestMs = Math.min(...latenciesMs)
      // A picture is never told older than it is, nor younger by more than its encoder took and a step.
      expect(apart(last, trueOrigin) / 90).toBeLessThanOrEqual(quickestMs + 10.1)
      expect(apart(last, modulo32(trueOrigin - quickestMs * 90)) / 90).toBeLessThanOrEqual(10.1)
    }),
  )
})

test('a picture that was never quick again is forgotten after ten seconds', () => {
  const latenciesMs = [5, ...Array<number>(400).fill(60)]
  const [first = NaN, second = NaN] = told(0, latenciesMs)
  expect(apart(first, second)).toBe(55 * 90)
})

test('timestamps that begin anew are followed at once', () => {
  const origin = new RtpOrigin()
  const before = origin.seen(1_000_000, 50_000) ?? NaN
  const after = origin.seen(3_900_000_000, 50_033) ?? NaN
  expect(after).toBe(modulo32(3_900_000_000 - 50_033 * 90))
  expect(after).not.toBe(before)
})

class FakeWorker implements TimesWorker {
  onmessage: TimesWorker['onmessage'] = null

  says(data: OriginNews | 'ready'): void {
    this.onmessage?.call(this as unknown as Worker, { data } as MessageEvent<OriginNews | 'ready'>)
  }
}

function rig() {
  const worker = new FakeWorker()
  const times = workerPictureTimes(
    () => worker,
    (_worker, options) => options as unknown as RTCRtpScriptTransform,
  )
  return { worker, times }
}

const line = (): PictureLine => ({ transform: null })

test('pictures wait for no worker: a line that is there before it runs goes without', () => {
  const { worker, times } = rig()
  const mine = line()
  const end = times(mine, vi.fn())
  worker.says('ready')
  end()
  expect(mine.transform).toBeNull()
})

test('one worker serves all lines, and each hears of its own until it ends', () => {
  const { worker, times } = rig()
  worker.says('ready')
  const lines = [line(), line()]
  const told = lines.map(() => vi.fn())
  const ends = lines.map((one, index) => times(one, told[index] ?? vi.fn()))
  expect(lines).toEqual([{ transform: { id: 1 } }, { transform: { id: 2 } }])
  worker.says({ id: 2, ssrc: 7, rtpOrigin: 9 })
  ends[1]?.()
  worker.says({ id: 2, ssrc: 7, rtpOrigin: 10 })
  expect(told.map(({ mock }) => mock.calls)).toEqual([[], [[{ ssrc: 7, rtpOrigin: 9 }]]])
})
