import type { Readable } from './Readable'
import type { RestApi } from './RestApi'
import type { RobotConnection } from './RobotConnection'
import type { StoreManager } from './StoreManager'
import type { RobotSummary, ServerState, Session } from './types'

/** The operator: one per page. */
export interface MosaicClient {
  readonly session: Readable<Session | null>
  /** True until a remembered session was checked: show neither log-in nor robots before. */
  readonly restoring: Readable<boolean>
  readonly server: Readable<ServerState>
  /** The robots of the account with their live status. */
  readonly robots: Readable<readonly RobotSummary[]>
  readonly api: RestApi
  readonly storeManager: StoreManager
  /** Check the remembered session, once at start. */
  restore(): Promise<void>
  login(email: string, password: string): Promise<void>
  loginWithCode(code: string): Promise<void>
  logout(): void
  refreshRobots(): Promise<void>
  connection(robotId: string): RobotConnection
}
