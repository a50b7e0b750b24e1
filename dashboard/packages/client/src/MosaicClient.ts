import { RobotStatus, type Catalogue, type DescribedConnector, type Finding, type SignalingMessage } from '@mosaic/protocol'
import { browserPlatform } from './platform/browserPlatform'
import { readAbilities } from './diagnosis/browserFindings'
import { checkConnection } from './diagnosis/checkConnection'
import { writeConnectorConfig } from './described/connectorConfig'
import { MosaicError } from './words/MosaicError'
import type { Platform } from './platform/Platform'
import { Value, type Readable } from './platform/Readable'
import { RestApi, type PairingSecret } from './signaling/RestApi'
import { RobotConnection } from './RobotConnection'
import { OperatorSignaling } from './signaling/operatorSignaling'
import { SessionIds } from './signaling/SessionIds'
import { SignalingSocket } from './signaling/SignalingSocket'
import { StoreManager } from './stores/StoreManager'
import { TokenStore } from './signaling/TokenStore'
import type { RobotSummary, ServerState, Session } from './words/types'

/** Where the server is, and what to use of the browser. */
export interface MosaicClientOptions {
  /** `https://mosaic.example.org`; without it the server that this page came from. */
  baseUrl?: string
  /** What to use in place of the browser's own things. */
  platform?: Platform
}

/** Represents the operator on one page: who is signed in, the robots, and one connection per robot. */
export class MosaicClient {
  /** The server's REST interface. */
  readonly api: RestApi
  /** The stores of all robots. */
  readonly storeManager: StoreManager
  private readonly platform: Platform
  private readonly socket: SignalingSocket
  private readonly sessionIds: SessionIds
  private readonly tokens: TokenStore
  private readonly connections = new Map<string, RobotConnection>()
  private readonly signedIn = new Value<Session | null>(null)
  private readonly isRestoring: Value<boolean>
  private readonly list = new Value<readonly RobotSummary[]>([])
  private readonly why = new Value<MosaicError | null>(null)

  /** Who is signed in; null: nobody. */
  readonly session: Readable<Session | null> = this.signedIn
  /** True until a remembered session was checked: show neither log-in nor robots before. */
  readonly restoring: Readable<boolean>
  /** Why the last session ended, if it wasn't by `logout`. */
  readonly sessionError: Readable<MosaicError | null> = this.why
  /** Whether the server's signaling socket is up. */
  readonly server: Readable<ServerState>
  /** The robots of the account with their live status. */
  readonly robots: Readable<readonly RobotSummary[]> = this.list

  constructor(options: MosaicClientOptions = {}) {
    this.platform = options.platform ?? browserPlatform()
    const baseUrl = (options.baseUrl ?? globalThis.location.origin).replace(/\/+$/, '')
    this.tokens = new TokenStore(this.platform)
    this.isRestoring = new Value(this.tokens.get() !== null)
    this.restoring = this.isRestoring
    const onUnauthorized = (error: MosaicError): void => this.end(error)
    this.api = new RestApi(baseUrl, () => this.tokens.get(), this.platform.fetch, onUnauthorized)
    this.socket = new SignalingSocket(`${baseUrl.replace(/^http/, 'ws')}/ws/user`, this.platform, new OperatorSignaling(() => this.platform.random()))
    this.server = this.socket.state
    this.sessionIds = new SessionIds(this.platform)
    this.storeManager = new StoreManager((robotId) => this.connection(robotId), () => this.platform.now())
    this.socket.onMessage((message) => this.signaled(message))
    this.socket.onRefused((code) => this.end(new MosaicError(code)))
    this.socket.state.subscribe(() => {
      if (this.socket.state.get() === 'online') void this.refreshRobots().catch(() => {})
    })
  }

  /** Check the remembered session, at the start. Never throws: without one, `session` stays null. */
  async restore(): Promise<void> {
    const token = this.tokens.get()
    try {
      if (token !== null) this.begin(token, await this.api.me(token))
    } catch (error) {
      // Only the server's refusal ends a session; a server that can't be reached does not.
      if (error instanceof MosaicError && this.tokens.get() !== null) this.why.set(error)
    } finally {
      this.isRestoring.set(false)
    }
  }

  /**
   * Whether this browser holds a session that the server has not ended. Without a `session`, `restore` could not check it
   * yet, and may be called again.
   */
  get remembersSession(): boolean {
    return this.tokens.get() !== null
  }

  /** Sign in; throws `MosaicError`. Without `remember` the session ends with the tab. */
  async login(email: string, password: string, { remember = true } = {}): Promise<void> {
    await this.signIn(await this.api.login(email, password), remember)
  }

  /** Sign in with a one-time code (`/#code=…`); throws `MosaicError`. */
  async loginWithCode(code: string): Promise<void> {
    await this.signIn(await this.api.loginWithCode(code), true)
  }

  /** Pair this browser with the robot whose server this is; throws `MosaicError`. `name` is what people call it. */
  async pair(secret: PairingSecret, name: string): Promise<void> {
    await this.signIn(await this.api.pair(secret, name), true)
  }

  /** Sign out: every connection ends and the remembered session is forgotten. */
  logout(): void {
    this.end(null)
  }

  /** Read the robots anew; throws `MosaicError`. Afterwards their status arrives by itself. */
  async refreshRobots(): Promise<void> {
    const session = this.signedIn.get()
    const robots = await this.api.robots()
    if (session === null || session !== this.signedIn.get()) return
    this.list.set(robots)
    for (const robot of robots) this.connections.get(robot.id)?.described(robot)
    this.socket.send('status.subscribe', { robotIds: robots.map(({ id }) => id) })
  }

  /**
   * Say what a robot has that announces nothing (an original one); kept on the server, for everybody. It replaces what
   * was said before. Throws `MosaicError`, `auth.forbidden` for those who may not operate the robot.
   */
  async describeRobot(robotId: string, connectors: readonly DescribedConnector[]): Promise<void> {
    const connectorConfig = writeConnectorConfig(connectors)
    await this.api.setConnectorConfig(robotId, connectorConfig)
    const word = { connectorConfig, connectorConfigIsStored: connectorConfig !== null }
    this.list.set(this.list.get().map((robot) => (robot.id === robotId ? { ...robot, ...word } : robot)))
    this.connection(robotId).described(word)
  }

  /** Whether connections can be made from here at all; needs no robot. `found` hears of each finding as it comes. */
  checkConnection(found: (finding: Finding) => void): Promise<void> {
    const { platform, api, socket } = this
    return checkConnection({ platform, api, server: () => socket.state.get(), abilities: readAbilities }, found)
  }

  /** This page's connection to the robot; always the same object. */
  connection(robotId: string): RobotConnection {
    const existing = this.connections.get(robotId)
    if (existing) return existing
    const { platform, api, socket, sessionIds } = this
    const connection = new RobotConnection(robotId, { platform, api, socket, sessionIds })
    this.connections.set(robotId, connection)
    const robot = this.list.get().find(({ id }) => id === robotId)
    if (robot) connection.described(robot)
    return connection
  }

  private async signIn(token: string, remember: boolean): Promise<void> {
    const user = await this.api.me(token)
    this.tokens.set(token, remember)
    this.begin(token, user)
  }

  private begin(token: string, user: Session['user']): void {
    this.why.set(null)
    this.signedIn.set({ token, user })
    this.socket.start(token)
  }

  private end(why: MosaicError | null): void {
    this.tokens.clear()
    this.sessionIds.forgetAll()
    for (const connection of this.connections.values()) connection.disconnect()
    this.socket.stop()
    this.list.set([])
    this.why.set(why)
    this.signedIn.set(null)
  }

  private signaled(message: SignalingMessage): void {
    if (message.type === 'catalogue.update') this.announced(message.data.robotId, message.data.catalogue)
    if (message.type !== 'status.update' || message.data.robotId === undefined) return
    const { robotId, status } = message.data
    const isOnline = status !== RobotStatus.DISCONNECTED
    const robots = this.list.get()
    const isNews = robots.some((robot) => robot.id === robotId && robot.status !== status)
    if (isNews) this.list.set(robots.map((robot) => (robot.id === robotId ? { ...robot, status, isOnline } : robot)))
  }

  private announced(robotId: string, catalogue: Catalogue): void {
    this.connection(robotId).announced(catalogue)
  }
}
