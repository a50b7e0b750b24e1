/** What a robot's status number means to somebody who wants to connect. */
import { RobotStatus, type RobotSummary } from '@mosaic/client'

export type PresenceKind = 'online' | 'busy' | 'starting' | 'offline'

export interface Presence {
  kind: PresenceKind
  text: string
}

const OFFLINE: Presence = { kind: 'offline', text: 'Offline' }
const UNKNOWN: Presence = { kind: 'offline', text: 'Unknown' }

const PRESENCE: Record<RobotStatus, Presence> = {
  [RobotStatus.READY_TO_CONNECT]: { kind: 'online', text: 'Online' },
  [RobotStatus.RTC_CONNECTING]: { kind: 'busy', text: 'Connecting to an operator' },
  [RobotStatus.RTC_CONNECTED]: { kind: 'busy', text: 'In use' },
  [RobotStatus.RTC_DISCONNECTING]: { kind: 'busy', text: 'Leaving an operator' },
  [RobotStatus.RTC_FAILED]: { kind: 'busy', text: 'Last connection failed' },
  [RobotStatus.DISCONNECTED]: OFFLINE,
  [RobotStatus.WS_CONNECTED]: { kind: 'starting', text: 'Starting' },
}

/** `isServerAway`: what it said last counts for nothing. */
export function presenceOf(robot: Pick<RobotSummary, 'status' | 'isOnline'>, isServerAway = false): Presence {
  if (isServerAway) return UNKNOWN
  return robot.isOnline ? PRESENCE[robot.status] : OFFLINE
}

const ORDER: readonly PresenceKind[] = ['online', 'busy', 'starting', 'offline']

/** Robots whose name, description or id holds every word of the search; those that can be used come first. */
export function foundRobots(robots: readonly RobotSummary[], search: string): RobotSummary[] {
  const words = search.toLowerCase().split(/\s+/).filter(Boolean)
  return robots
    .filter((robot) => {
      const text = `${robot.name} ${robot.description} ${robot.id}`.toLowerCase()
      return words.every((word) => text.includes(word))
    })
    .sort((one, other) => rank(one) - rank(other) || one.name.localeCompare(other.name))
}

function rank(robot: RobotSummary): number {
  return ORDER.indexOf(presenceOf(robot).kind)
}
