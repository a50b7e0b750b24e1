/** Where this device is, as a connector: `mosaic/GpsFix@1`. */
import { microseconds } from '@mosaic/client/parts'
import type { messages } from '@mosaic/protocol'
import { dataEntry } from '../connectors/catalogue'
import type { DataConnector } from '../connectors/Connector'

/** A position, as the W3C's Geolocation tells it. */
export interface FoundPosition {
  timestamp: number
  coords: Pick<GeolocationCoordinates, 'latitude' | 'longitude' | 'altitude' | 'accuracy' | 'speed' | 'heading'>
}

const RADIANS = Math.PI / 180

export function fixOf({ coords, timestamp }: FoundPosition): messages.GpsFix {
  const { latitude, longitude, altitude, accuracy, speed, heading } = coords
  const fix: messages.GpsFix = { latitude, longitude, altitude, accuracy_m: accuracy, timestamp: microseconds(timestamp) }
  if (speed !== null) fix.speed_mps = speed
  // At rest there is none; some browsers say NaN.
  if (heading !== null && Number.isFinite(heading)) fix.course_rad = heading * RADIANS
  return fix
}

export function position(geolocation: Geolocation): DataConnector {
  return {
    entry: dataEntry('position', 'GpsFix', 'latest'),
    start: ({ tell, failed }) => {
      const found = (position: GeolocationPosition): void => {
        failed('')
        tell(fixOf(position))
      }
      const watch = geolocation.watchPosition(found, (error) => failed(positionProblem(error)), { enableHighAccuracy: true })
      return () => geolocation.clearWatch(watch)
    },
  }
}

/** Ask for leave, while somebody has just pressed a button. Rejects with what to do; one that is only slow is none. */
export function askForPosition(geolocation: Geolocation): Promise<void> {
  return new Promise((resolve, reject) => {
    const failed = (error: GeolocationPositionError): void => {
      if (error.code === error.PERMISSION_DENIED) reject(new Error(positionProblem(error)))
      else resolve()
    }
    geolocation.getCurrentPosition(() => resolve(), failed, { maximumAge: Infinity, timeout: 1000 })
  })
}

function positionProblem(error: GeolocationPositionError): string {
  if (error.code === error.PERMISSION_DENIED) return 'This page may not know the position. Allow it beside the address, then start again.'
  return error.code === error.TIMEOUT ? 'No position yet; go where the sky can be seen.' : 'The position can’t be found; switch on location in the system’s settings.'
}
