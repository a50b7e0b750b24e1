/** The clock of the drive pad: it ticks only while it is needed, from a worker where there is one. */
import { TICK_MS } from './driveControl'

export interface DriveClock {
  start(): void
  stop(): void
  dispose(): void
}

export type MakeDriveClock = (onTick: () => void) => DriveClock

export const makeDriveClock: MakeDriveClock = (onTick) => {
  try {
    return workerClock(onTick)
  } catch {
    // No workers here (an old browser or a strict policy): the page's own timer; late ticks stop the robot.
    return intervalClock(onTick)
  }
}

function workerClock(onTick: () => void): DriveClock {
  const worker = new Worker(new URL('./driveClock.worker.ts', import.meta.url), { type: 'module' })
  worker.addEventListener('message', onTick)
  return {
    start: () => worker.postMessage({ periodMs: TICK_MS }),
    stop: () => worker.postMessage({ periodMs: null }),
    dispose: () => worker.terminate(),
  }
}

export function intervalClock(onTick: () => void): DriveClock {
  let timer: ReturnType<typeof setInterval> | undefined
  const stop = () => clearInterval(timer)
  return {
    start: () => {
      stop()
      timer = setInterval(onTick, TICK_MS)
    },
    stop,
    dispose: stop,
  }
}
