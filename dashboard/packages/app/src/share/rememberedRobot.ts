/**
 * Keeps which robot this browser is, over days: the same phone is the same robot tomorrow. Its token lets whoever has it be this
 * robot and nothing more, and ends when somebody makes a new one or deletes the robot.
 */
import type { RobotCredentials } from '@mosaic/robot'

const KEY = 'mosaic.sharedRobot'

export interface RememberedRobot extends RobotCredentials {
  name: string
}

export function rememberedRobot(): RememberedRobot | null {
  try {
    const found: unknown = JSON.parse(localStorage.getItem(KEY) ?? 'null')
    return isRobot(found) ? found : null
  } catch {
    // Storage is forbidden, or holds something else: then nothing is remembered.
    return null
  }
}

/** False where the browser keeps nothing: the next time it is another robot. */
export function rememberRobot(robot: RememberedRobot): boolean {
  try {
    localStorage.setItem(KEY, JSON.stringify(robot))
    return true
  } catch {
    return false
  }
}

export function forgetRobot(): void {
  try {
    localStorage.removeItem(KEY)
  } catch {
    // There is nothing to forget.
  }
}

function isRobot(found: unknown): found is RememberedRobot {
  if (typeof found !== 'object' || found === null) return false
  return ['robotId', 'token', 'name'].every((key) => typeof (found as Record<string, unknown>)[key] === 'string')
}
