/** A velocity as the connector's kind of robot takes it: MOSAIC has several. Pure. */
import type { DriveCommand } from '@mosaic/client'
import type { DriveLimits, Twist } from './driveTwist'

/** The whole message. Without a `drive` it is the Twist that nearly all take. */
export function commandOf(twist: Twist, drive: DriveCommand | null, limits: DriveLimits): object {
  if (drive === null) return twist
  const { unit, leftSign } = drive
  const message = structuredClone(drive.zero)
  const scale = (value: number, most: number): number => (unit === 'si' || most === 0 ? value : value / most)
  put(message, drive.ahead, scale(twist.linear.x, limits.maxLinearMps))
  put(message, drive.left, scale(twist.angular.z, limits.maxAngularRadps) * leftSign)
  if (drive.sideways !== undefined) put(message, drive.sideways, scale(twist.linear.y, limits.maxLinearMps))
  return message
}

/** `0.50 m/s · 0.20 rad/s`, or per cent where only the robot knows how fast its full speed is. */
export function velocityText(aheadMps: number, turnRadps: number, drive: DriveCommand | null, limits: DriveLimits): string {
  if (drive?.unit !== 'share') return `${aheadMps.toFixed(2)} m/s · ${turnRadps.toFixed(2)} rad/s`
  const percent = (value: number, most: number): string => `${Math.round((value / (most || 1)) * 100)} %`
  return `${percent(aheadMps, limits.maxLinearMps)} ahead · ${percent(turnRadps, limits.maxAngularRadps)} turn`
}

function put(message: Record<string, unknown>, path: string, value: number): void {
  const keys = path.split('.')
  const last = keys.pop() ?? ''
  const node = keys.reduce((inner, key) => inner[key] as Record<string, unknown>, message)
  // JSON has a minus zero, and a robot may print it.
  node[last] = value === 0 ? 0 : value
}
