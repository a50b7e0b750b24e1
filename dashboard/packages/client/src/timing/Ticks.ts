/** A clock that ticks at a steady pace even where a throttled tab stretches the page's own timers. */

export interface Ticks {
  /** Call `onTick` every `periodMs`; the result ends it. */
  readonly every: (periodMs: number, onTick: () => void) => () => void
}

/** The page's own timers: for tests, and for browsers without workers. */
export const timerTicks: Ticks = {
  every: (periodMs, onTick) => {
    const timer = setInterval(onTick, periodMs)
    return () => clearInterval(timer)
  },
}

interface Rhythm {
  periodMs: number
  onTick: () => void
  endFallback: (() => void) | null
}

/** What of a `Worker` is needed; `onerror` also tells of one that a strict policy forbids. */
export type TickWorker = Pick<Worker, 'postMessage' | 'onmessage' | 'onerror'>

/** Ticks of one worker for all; where none can be had, of `fallback`. The worker is made at the first need. */
export function workerTicks(makeWorker: () => TickWorker, fallback: Ticks = timerTicks): Ticks {
  const rhythms = new Map<number, Rhythm>()
  let worker: TickWorker | null | undefined
  let lastId = 0

  const fallBack = (): void => {
    worker = null
    for (const rhythm of rhythms.values()) rhythm.endFallback ??= fallback.every(rhythm.periodMs, rhythm.onTick)
  }
  const begin = (): TickWorker | null => {
    try {
      const made = makeWorker()
      made.onmessage = (event: MessageEvent<number>) => rhythms.get(event.data)?.onTick()
      made.onerror = fallBack
      return made
    } catch {
      return null
    }
  }
  return {
    every: (periodMs, onTick) => {
      worker ??= worker === null ? null : begin()
      const id = ++lastId
      const rhythm: Rhythm = { periodMs, onTick, endFallback: null }
      rhythms.set(id, rhythm)
      if (worker) worker.postMessage({ id, periodMs })
      else rhythm.endFallback = fallback.every(periodMs, onTick)
      return () => {
        if (!rhythms.delete(id)) return
        rhythm.endFallback?.()
        worker?.postMessage({ id, periodMs: null })
      }
    },
  }
}

/** The page's clock, shared by everything that must not be slowed down in a tab nobody looks at. */
export const pageTicks: Ticks = workerTicks(
  () => new Worker(new URL('./ticks.worker.ts', import.meta.url), { type: 'module' }),
)
