/** The charge of this device, as a connector: `mosaic/BatteryState@1`. Only Chromium's browsers tell it. */
import { microseconds, wallClockMs } from '@mosaic/client/parts'
import type { messages } from '@mosaic/protocol'
import { dataEntry } from '../connectors/catalogue'
import type { DataConnector } from '../connectors/Connector'

const EVENTS = ['levelchange', 'chargingchange'] as const

/** The W3C's `BatteryManager`, which TypeScript does not know. */
export interface BatteryManager extends Pick<EventTarget, 'addEventListener' | 'removeEventListener'> {
  readonly level: number
  readonly charging: boolean
}

export type GetBattery = () => Promise<BatteryManager>

/** Null where the browser does not tell. */
export function browserGetBattery(from: object): GetBattery | null {
  const get: unknown = 'getBattery' in from ? from.getBattery : undefined
  return typeof get === 'function' ? () => get.call(from) as Promise<BatteryManager> : null
}

export function batteryStateOf({ level, charging }: Pick<BatteryManager, 'level' | 'charging'>, timestamp: number): messages.BatteryState {
  return { percent: Math.round(level * 100), charging, timestamp }
}

export function battery(getBattery: GetBattery): DataConnector {
  return {
    entry: dataEntry('battery', 'BatteryState', 'latest'),
    start: ({ tell, failed }) => {
      let end = (): void => {}
      let isOver = false
      const watch = (manager: BatteryManager): void => {
        if (isOver) return
        const say = (): void => tell(batteryStateOf(manager, microseconds(wallClockMs())))
        for (const event of EVENTS) manager.addEventListener(event, say)
        end = () => EVENTS.forEach((event) => manager.removeEventListener(event, say))
        say()
      }
      getBattery().then(watch, (error: unknown) => failed(`The battery can’t be read (${String(error)}).`))
      return () => {
        isOver = true
        end()
      }
    },
  }
}
