import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest'
import { timerTicks, workerTicks, type TickWorker } from '../../src/timing/Ticks'

beforeEach(() => {
  vi.useFakeTimers()
})

afterEach(() => {
  vi.useRealTimers()
})

class FakeWorker implements TickWorker {
  onmessage: TickWorker['onmessage'] = null
  onerror: TickWorker['onerror'] = null
  readonly asked: { id: number; periodMs: number | null }[] = []
  readonly postMessage = (message: { id: number; periodMs: number | null }): void => void this.asked.push(message)

  ticks(id: number): void {
    this.onmessage?.call(this as unknown as Worker, { data: id } as MessageEvent<number>)
  }
}

describe('the ticks of a worker', () => {
  test('come from one worker for all, made when it is first needed', () => {
    const worker = new FakeWorker()
    const make = vi.fn(() => worker)
    const { every } = workerTicks(make)
    expect(make).not.toHaveBeenCalled()
    const [fast, slow] = [vi.fn(), vi.fn()]
    every(30, fast)
    every(500, slow)
    expect(make).toHaveBeenCalledTimes(1)
    expect(worker.asked).toEqual([{ id: 1, periodMs: 30 }, { id: 2, periodMs: 500 }])
    worker.ticks(1)
    worker.ticks(1)
    worker.ticks(2)
    expect([fast.mock.calls.length, slow.mock.calls.length]).toEqual([2, 1])
  })

  test('end when they are no longer wanted, even those already on the way', () => {
    const worker = new FakeWorker()
    const onTick = vi.fn()
    const end = workerTicks(() => worker).every(30, onTick)
    end()
    end()
    worker.ticks(1)
    expect(onTick).not.toHaveBeenCalled()
    expect(worker.asked).toEqual([{ id: 1, periodMs: 30 }, { id: 1, periodMs: null }])
  })

  test('come from the page where workers are forbidden', () => {
    const make = vi.fn(() => {
      throw new Error('SecurityError')
    })
    const { every } = workerTicks(make)
    const onTick = vi.fn()
    const end = every(30, onTick)
    every(30, () => {})
    expect(make).toHaveBeenCalledTimes(1)
    vi.advanceTimersByTime(90)
    expect(onTick).toHaveBeenCalledTimes(3)
    end()
    vi.advanceTimersByTime(90)
    expect(onTick).toHaveBeenCalledTimes(3)
  })

  test('go on from the page when the worker turns out not to load', () => {
    const worker = new FakeWorker()
    const { every } = workerTicks(() => worker)
    const onTick = vi.fn()
    const end = every(30, onTick)
    worker.onerror?.call(worker as unknown as Worker, new Event('error') as ErrorEvent)
    const later = vi.fn()
    every(30, later)
    vi.advanceTimersByTime(60)
    expect([onTick.mock.calls.length, later.mock.calls.length]).toEqual([2, 2])
    end()
    vi.advanceTimersByTime(60)
    expect(onTick).toHaveBeenCalledTimes(2)
  })
})

test('the ticks of the page are timers', () => {
  const onTick = vi.fn()
  const end = timerTicks.every(100, onTick)
  vi.advanceTimersByTime(250)
  end()
  vi.advanceTimersByTime(250)
  expect(onTick).toHaveBeenCalledTimes(2)
})
