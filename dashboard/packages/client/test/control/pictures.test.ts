import fc from 'fast-check'
import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest'
import type { MediaStreamStore } from '../../src/index'
import { PictureReports } from '../../src/control/PictureReports'
import { greeted, ROBOT } from '../bench'
import type { FakePeerConnection } from '../fakes'

describe('reports of pictures', () => {
  test('say nothing of a picture that nobody watches', () => {
    const reports = new PictureReports()
    expect(reports.seen('front', 5, 0)).toBeNull()
    expect(reports.ticked(1000)).toEqual([])
  })

  test('say that nothing has been shown yet', () => {
    const reports = new PictureReports()
    reports.begin('front')
    expect(reports.ticked(1000)).toEqual([{ label: 'front' }])
  })

  test('tell the first picture at once, then the newest at most every 100 ms', () => {
    const reports = new PictureReports()
    reports.begin('front')
    expect(reports.seen('front', 1, 1000)).toEqual({ label: 'front', captureUs: 1 })
    expect(reports.seen('front', 2, 1033)).toBeNull()
    expect(reports.seen('front', 3, 1066)).toBeNull()
    expect(reports.seen('front', 4, 1100)).toEqual({ label: 'front', captureUs: 4 })
  })

  test('repeat a frozen picture as the old one that it is', () => {
    const reports = new PictureReports()
    reports.begin('front')
    reports.seen('front', 1, 1000)
    expect([reports.ticked(1100), reports.ticked(1200)].flat()).toEqual([
      { label: 'front', captureUs: 1 },
      { label: 'front', captureUs: 1 },
    ])
  })

  test('end with the watching, and start anew', () => {
    const reports = new PictureReports()
    reports.begin('front')
    reports.seen('front', 1, 1000)
    reports.begin('front')
    expect(reports.ticked(1100)).toEqual([{ label: 'front', captureUs: 1 }])
    reports.end('front')
    expect(reports.isIdle).toBe(true)
    reports.begin('front')
    expect(reports.ticked(1200)).toEqual([{ label: 'front' }])
    reports.clear()
    expect(reports.isIdle).toBe(true)
  })

  test('never go back in time and never come closer than nine tenths of the period', () => {
    fc.assert(
      fc.property(fc.array(fc.tuple(fc.boolean(), fc.integer({ min: 0, max: 120 }), fc.integer({ min: 0, max: 999 }))), (steps) => {
        const reports = new PictureReports()
        reports.begin('front')
        const told: { atMs: number; captureUs: number }[] = []
        let nowMs = 0
        for (const [isTick, ms, captureUs] of steps) {
          nowMs += ms
          const said = isTick ? reports.ticked(nowMs) : [reports.seen('front', captureUs, nowMs)]
          for (const one of said) if (one) told.push({ atMs: nowMs, captureUs: one.captureUs ?? -1 })
        }
        told.slice(1).forEach((one, index) => {
          const before = told[index]
          expect(one.atMs - (before?.atMs ?? 0)).toBeGreaterThanOrEqual(90)
          expect(one.captureUs).toBeGreaterThanOrEqual(before?.captureUs ?? 0)
        })
      }),
    )
  })
})

describe('on a connection', () => {
  beforeEach(() => {
    vi.useFakeTimers({ toFake: ['setTimeout', 'clearTimeout', 'setInterval', 'clearInterval', 'performance', 'Date'] })
  })

  afterEach(() => {
    vi.useRealTimers()
  })

  const RTP_ORIGIN = 4_000_000_000

  /** A picture watched on a page whose clock is known to be 7 s behind the robot's. */
  async function watching() {
    const bench = await greeted()
    const { client, platform, peer } = bench
    const control = peer.channel('_mosaic')
    peer.brings('1', 'rear')
    const store = client.storeManager.getOrCreateStore({ robotId: ROBOT, connectorId: 'rear' }) as MediaStreamStore
    const leave = store.mediaStream.subscribe(() => {})
    const robotUs = (atMs = platform.now()): number => Math.round((atMs + 7000) * 1000)
    const compareClocks = (): void => {
      const t0 = Math.round(platform.now() * 1000)
      control.control('pong', { t0, t1: robotUs(), t2: robotUs() })
    }
    const tellOrigin = (rtpOrigin = RTP_ORIGIN): void =>
      control.control('media.origin', { label: 'rear', ssrc: 1, rtpOrigin, bootId: 'b1' })
    return { ...bench, control, store, leave, robotUs, compareClocks, tellOrigin }
  }

  const rtpOf = (captureUs: number, origin = RTP_ORIGIN): number => (Math.round((captureUs * 9) / 100) + origin) % 2 ** 32
  const seen = (peer: FakePeerConnection): unknown[] =>
    peer
      .channel('_mosaic')
      .controlSent()
      .filter(({ type }) => type === 'media.seen')
      .map(({ data }) => data)

  test('the robot is told when the picture on the screen was captured, on its own clock', async () => {
    const { peer, platform, store, robotUs, compareClocks, tellOrigin } = await watching()
    compareClocks()
    tellOrigin()
    peer.channel('_mosaic').sent.length = 0
    const captureUs = robotUs() - 80_000
    store.pictureShown(rtpOf(captureUs), platform.now())
    expect(seen(peer)).toEqual([{ label: 'rear', captureUs: expect.closeTo(captureUs, -2) as number }])
    expect(store.displayedAgeMs.get()).toBeCloseTo(80, 0)
  })

  test('the stamp is the robot\'s own, however badly the clocks are known', async () => {
    const { peer, platform, client, robotUs, tellOrigin } = await watching()
    // An answer that came by a lame way: half a second of error.
    const t0 = Math.round((platform.now() - 1000) * 1000)
    peer.channel('_mosaic').control('pong', { t0, t1: robotUs(), t2: robotUs() })
    tellOrigin()
    peer.channel('_mosaic').sent.length = 0
    const captureUs = robotUs() - 900_000
    client.connection(ROBOT).pictureSeen('rear', rtpOf(captureUs), platform.now())
    expect(seen(peer)).toEqual([{ label: 'rear', captureUs: expect.closeTo(captureUs, -2) as number }])
  })

  test('while nothing is shown it is told just that, ten times a second, and nothing before its clock is known', async () => {
    const { peer, tellOrigin } = await watching()
    await vi.advanceTimersByTimeAsync(300)
    expect(seen(peer)).toEqual([])
    tellOrigin()
    await vi.advanceTimersByTimeAsync(310)
    expect(seen(peer)).toEqual([{ label: 'rear' }, { label: 'rear' }, { label: 'rear' }])
  })

  test('it ends when nobody looks, the page is hidden, or the link is lost', async () => {
    for (const end of ['leave', 'hide', 'lose'] as const) {
      const { peer, platform, leave, tellOrigin } = await watching()
      tellOrigin()
      await vi.advanceTimersByTimeAsync(110)
      expect(seen(peer)).toHaveLength(1)
      if (end === 'leave') leave()
      if (end === 'hide') platform.visible = false
      if (end === 'hide') platform.happens('visibility')
      if (end === 'lose') peer.channel('_mosaic').vanishes()
      await vi.advanceTimersByTimeAsync(400)
      expect(seen(peer)).toHaveLength(1)
    }
  })

  test('a picture that is kept, as a recording does, comes on in a hidden page and without a listener', async () => {
    const { peer, platform, store, leave } = await watching()
    const asked = (): unknown[] =>
      peer
        .channel('_mosaic')
        .controlSent()
        .filter(({ type }) => type === 'media.watch')
        .map(({ data }) => data)
    const end = store.keep()
    const endOther = store.keep()
    platform.visible = false
    platform.happens('visibility')
    leave()
    end()
    end()
    expect(asked()).toEqual([{ label: 'rear', on: true }])
    endOther()
    expect(asked()).toEqual([
      { label: 'rear', on: true },
      { label: 'rear', on: false },
    ])
  })

  test('a picture of the future is of another clock and is not told', async () => {
    const { peer, platform, store, robotUs, compareClocks, tellOrigin } = await watching()
    compareClocks()
    tellOrigin()
    peer.channel('_mosaic').sent.length = 0
    store.pictureShown(rtpOf(robotUs() + 400_000), platform.now())
    expect(seen(peer)).toEqual([])
  })

  test('a new origin forgets what was told by the old one', async () => {
    const { peer, platform, store, robotUs, compareClocks, tellOrigin } = await watching()
    compareClocks()
    tellOrigin(17)
    store.pictureShown(rtpOf(robotUs(), 17), platform.now())
    tellOrigin(99)
    peer.channel('_mosaic').sent.length = 0
    const captureUs = robotUs() - 500_000
    store.pictureShown(rtpOf(captureUs, 99), platform.now())
    expect(seen(peer)).toEqual([{ label: 'rear', captureUs: expect.closeTo(captureUs, -2) as number }])
  })

  test('the age of the picture on the screen grows while it is frozen, and ends with the track', async () => {
    const { peer, platform, store, robotUs, compareClocks, tellOrigin } = await watching()
    expect(store.pictureAgeNowMs()).toBeNull()
    store.pictureShown(1, platform.now())
    expect(store.displayedAgeMs.get()).toBeNull()
    compareClocks()
    tellOrigin()
    store.pictureShown(rtpOf(robotUs() - 50_000), platform.now())
    await vi.advanceTimersByTimeAsync(200)
    expect(store.displayedAgeMs.get()).toBeCloseTo(50, 0)
    expect(store.pictureAgeNowMs()).toBeCloseTo(250, 0)
    peer.channel('_mosaic').vanishes()
    expect(store.displayedAgeMs.get()).toBeNull()
    expect(store.pictureAgeNowMs()).toBeNull()
  })
})
