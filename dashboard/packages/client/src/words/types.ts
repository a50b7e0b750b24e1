import type { MosaicDataType, RobotStatus } from '@mosaic/protocol'
import type { Role } from './views'

/** Names one connector of one robot. Without `dataType` the robot's catalogue decides. */
export interface RobotConnector {
  robotId: string
  connectorId: string
  dataType?: MosaicDataType
}

/** What is known of a message besides its bytes. */
export interface MessageInfo {
  /** When it arrived, in milliseconds of this page's clock (`performance.timeOrigin + now()`). */
  receivedAtMs: number
  /** Number of the message on its channel; 0 from an original robot. */
  seq: number
  /** When the robot made it, in microseconds of the robot's monotonic clock; 0 from an original robot. */
  stampUs: number
  /** True for the last value, repeated because this page came later. */
  latched: boolean
  /**
   * How old it was on arrival; null while the clocks have not been compared, which is a round trip after a connection
   * is up, and always from an original robot. It is then known of earlier messages too: read it when it is shown.
   */
  readonly ageMs: number | null
}

/**
 * Where a store stands: `waiting` for a connection, `open`, `reconnecting` (it was lost and is being made anew), `closed`
 * after one, or `mismatch`: the robot has no such connector (`nearest` is the label that was perhaps meant).
 */
export interface StoreState {
  phase: 'waiting' | 'open' | 'reconnecting' | 'closed' | 'mismatch'
  code?: string
  message?: string
  nearest?: string
}

/**
 * Messages of a reliable connector that will never arrive: the connection was gone for longer than they could be kept.
 * `lost`: how many, null where nobody knows; `sent`: those that the store sent, not those that it gets.
 */
export interface Gap {
  lost: number | null
  sent: boolean
  atMs: number
}

/** `failed`: it won't come back by itself; `closed`: it was ended on purpose. */
export type ConnectionPhase = 'idle' | 'connecting' | 'connected' | 'reconnecting' | 'failed' | 'closed'

/** Where a robot's connection stands, with the reason if there is one. */
export interface ConnectionState {
  phase: ConnectionPhase
  code?: string
  message?: string
  roundTripMs: number | null
}

/** The account that is signed in. */
export interface User {
  id: string
  email: string
  isActive: boolean
  isOrganizationAdmin: boolean
  fullName: string
}

/** A robot as the server's REST interface tells it. */
export interface RobotInfo {
  id: string
  name: string
  description: string
  status: RobotStatus
  authType: number
  organizationId: string
  /** Its connectors, as original dashboards keep them: JSON in a string. */
  connectorConfig?: string | null
  /** False: the server made it from what the robot announced. Absent from original servers, which only store it. */
  connectorConfigIsStored?: boolean
  isOnline: boolean
  /** What this account may do with it; absent from original servers. */
  myRole?: Role
}

/** An account of the organization, and what it may do with one robot. */
export interface RoleOnRobot {
  accountId: string
  email: string
  fullName: string
  isActive: boolean
  isProgram: boolean
  isOrganizationAdmin: boolean
  /** What counts. */
  role: Role
  /** False: nothing was granted for this robot, `role` is the account's default. */
  isGranted: boolean
}

/** The organization whose robots these are. */
export interface Organization {
  id: string
  name: string
  defaultRole: Role
}

/** A robot with its live status. */
export type RobotSummary = RobotInfo

/** Who is signed in, and the token that says so. */
export interface Session {
  token: string
  user: User
}

/** Whether the server's signaling socket is up. */
export type ServerState = 'offline' | 'connecting' | 'online'
