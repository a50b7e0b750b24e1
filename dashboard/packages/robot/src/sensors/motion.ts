/** How this device is held and moved, as a connector: `mosaic/Imu@1`. */
import { microseconds, wallClockMs } from '@mosaic/client/parts'
import type { messages } from '@mosaic/protocol'
import { dataEntry } from '../connectors/catalogue'
import type { DataConnector } from '../connectors/Connector'
import { imuOf, quaternionOf } from './attitude'

/** Phones tell sixty a second; a widget shows no more than these. */
const PERIOD_MS = 50
/** A laptop fires one empty event and has no such sensors. */
const SILENCE_MS = 3000

export function motion(page: Window, now: () => number): DataConnector {
  return {
    entry: dataEntry('motion', 'Imu', 'latest'),
    start: ({ tell, failed }) => {
      let attitude: messages.Quaternion | null = null
      let toldMs = -Infinity
      const turned = (event: DeviceOrientationEvent): void => void (attitude = quaternionOf(event))
      const moved = (event: DeviceMotionEvent): void => {
        const imu = now() - toldMs < PERIOD_MS ? null : imuOf(event, attitude, microseconds(wallClockMs()))
        if (imu === null) return
        clearTimeout(silence)
        failed('')
        toldMs = now()
        tell(imu)
      }
      const silence = setTimeout(() => failed('This device tells no motion.'), SILENCE_MS)
      page.addEventListener('deviceorientation', turned)
      page.addEventListener('devicemotion', moved)
      return () => {
        clearTimeout(silence)
        page.removeEventListener('deviceorientation', turned)
        page.removeEventListener('devicemotion', moved)
      }
    },
  }
}

/** iOS asks for leave, and only while somebody has just pressed a button. Rejects with what to do. */
export async function askForMotion(page: object): Promise<void> {
  for (const name of ['DeviceMotionEvent', 'DeviceOrientationEvent']) {
    const event: unknown = (page as Record<string, unknown>)[name]
    if (!asks(event)) continue
    if ((await event.requestPermission()) !== 'granted') throw new Error('This page may not know how the device moves. Close its tab, open it again and allow it.')
  }
}

function asks(event: unknown): event is { requestPermission(): Promise<string> } {
  return typeof event === 'function' && 'requestPermission' in event && typeof event.requestPermission === 'function'
}
