/** Degrees to metres around a first fix. */
import { isObject } from '../schema/jsonSchema'

export interface Fix {
  latitudeDeg: number
  longitudeDeg: number
  altitudeM: number | null
}

/** Reads the spellings that robots of MOSAIC use; null without a fix. */
export function fixOf(message: unknown): Fix | null {
  if (!isObject(message)) return null
  if (isObject(message['coordinate'])) return fixOf(message['coordinate'])
  const latitudeDeg = within(message['latitude'] ?? message['lat'], 90)
  const longitudeDeg = within(message['longitude'] ?? message['lng'] ?? message['lon'], 180)
  if (latitudeDeg === null || longitudeDeg === null) return null
  return { latitudeDeg, longitudeDeg, altitudeM: within(message['altitude'], Infinity) }
}

/** WGS84 semi-major axis and first eccentricity squared (NIMA TR8350.2). */
const SEMI_MAJOR_M = 6_378_137
const ECCENTRICITY_2 = 6.694_379_990_14e-3

/** East and north of `origin`, by the ellipsoid's radii of curvature there: good to centimetres over a kilometre. */
export function metresFrom(origin: Fix, fix: Fix): { eastM: number; northM: number } {
  const latitude = radians(origin.latitudeDeg)
  const w = 1 - ECCENTRICITY_2 * Math.sin(latitude) ** 2
  const normal = SEMI_MAJOR_M / Math.sqrt(w)
  const meridian = (SEMI_MAJOR_M * (1 - ECCENTRICITY_2)) / w ** 1.5
  const turned = ((fix.longitudeDeg - origin.longitudeDeg + 540) % 360) - 180
  return {
    eastM: radians(turned) * normal * Math.cos(latitude),
    northM: radians(fix.latitudeDeg - origin.latitudeDeg) * meridian,
  }
}

export function fixText({ latitudeDeg, longitudeDeg, altitudeM }: Fix): string {
  const latitude = `${Math.abs(latitudeDeg).toFixed(6)}° ${latitudeDeg < 0 ? 'S' : 'N'}`
  const longitude = `${Math.abs(longitudeDeg).toFixed(6)}° ${longitudeDeg < 0 ? 'W' : 'E'}`
  return [latitude, longitude, altitudeM === null ? null : `${altitudeM.toFixed(1)} m`].filter(Boolean).join(' · ')
}

function radians(degrees: number): number {
  return (degrees * Math.PI) / 180
}

function within(value: unknown, most: number): number | null {
  return typeof value === 'number' && Number.isFinite(value) && Math.abs(value) <= most ? value : null
}
