import { isReasonCode, parseCatalogue, parseIceServers, plainText, reasonOfResult, type Catalogue, type IceServer, type WidgetModule } from '@mosaic/protocol'
import type { Role } from '../words/views'
import { MosaicError } from '../words/MosaicError'
import type { Organization, RobotInfo, RoleOnRobot, User } from '../words/types'

/** What a server says of itself. */
export interface ServerInfo {
  name: string
  version: string
  extensions: Record<string, number>
  signup: boolean
  /** The one robot that this server belongs to, with which devices are paired; null or absent on all others. */
  pairsWith?: string | null
}

/** The modules of widgets that a server serves, each at `/widgets/SHA256.js`. */
export interface WidgetOffer {
  /** False: whoever runs the server has switched them off. */
  isOn: boolean
  modules: readonly WidgetModule[]
}

/** What pairs a device: a PIN that was read, or a code that was scanned. */
export type PairingSecret = { pin: string } | { code: string }

/** The server's leave to connect to a robot. */
export interface ConnectionGrant {
  robotId: string
  rtcSessionId: string
  sessionId?: string
}

/** A tab of an original dashboard. */
export interface DashboardTab {
  id: string
  name: string
}

/** What a robot is made or changed with. */
export interface NewRobot {
  name: string
  description?: string
  authType?: number
}

const TIMEOUT_MS = 10_000

/** Calls the server's REST interface, with types. Every failure is a `MosaicError` with a reason code. */
export class RestApi {
  constructor(
    private readonly baseUrl: string,
    private readonly token: () => string | null,
    private readonly fetch: typeof globalThis.fetch,
    private readonly onUnauthorized: (error: MosaicError) => void = () => {},
  ) {}

  /** The access token of an account. */
  login(username: string, password: string): Promise<string> {
    const body = { username, password }
    return this.signIn('/api/v1/account/login/access-token', body)
  }

  /** The access token that a one-time code gives. */
  loginWithCode(code: string): Promise<string> {
    return this.signIn('/api/v1/account/login/one-time', { code })
  }

  /** A code that signs this account in somewhere else, once and within a minute: put it behind `/#code=`. */
  async issueCode(): Promise<string> {
    return (await this.post<{ code: string }>('/api/v1/account/one-time-code', {})).code
  }

  /** Pair this browser with a robot that serves its own network; the token counts until the device is revoked. */
  pair(secret: PairingSecret, name: string): Promise<string> {
    return this.signIn('/api/v1/pairing', { ...secret, name })
  }

  /** Make an account, where the server lets anybody do so. */
  async signup(account: { email: string; password: string; fullName: string }): Promise<void> {
    await this.post('/api/v1/account/signup', account)
  }

  /** The account that is signed in; `token` where it is not yet (or not) the session's. */
  me(token?: string): Promise<User> {
    return this.request<User>('GET', '/api/v1/users/me', undefined, token)
  }

  /** What the server says of itself. */
  server(): Promise<ServerInfo> {
    return this.request<ServerInfo>('GET', '/api/v1/server')
  }

  /** The server, and what its wall clock said; null where it does not tell (or another origin may not read it). */
  async introduction(): Promise<{ info: ServerInfo; dateMs: number | null }> {
    const init = { headers: { Accept: 'application/json' }, cache: 'no-store', signal: AbortSignal.timeout(TIMEOUT_MS) } as const
    const response = await this.reach('/api/v1/server', init)
    const answer = await jsonOf(response)
    if (!response.ok || isRefusal(answer)) throw errorOf(response.status, answer)
    // eslint-disable-next-line no-restricted-syntax -- the server's wall clock is what is asked for
    const dateMs = Date.parse(response.headers.get('Date') ?? '')
    return { info: resultOf(answer) as ServerInfo, dateMs: Number.isNaN(dateMs) ? null : dateMs }
  }

  /** The widgets of the plugins that are installed on the server. */
  widgets(): Promise<WidgetOffer> {
    return this.request<WidgetOffer>('GET', '/api/v1/widgets')
  }

  /** All robots of the account. */
  robots(): Promise<RobotInfo[]> {
    return this.every<RobotInfo>('/api/v1/robots')
  }

  /** One robot of the account. */
  robot(robotId: string): Promise<RobotInfo> {
    return this.request<RobotInfo>('GET', robotPath(robotId))
  }

  /** Make a robot; its token comes from `newRobotToken`. */
  createRobot(robot: NewRobot): Promise<{ id: string; message: string }> {
    return this.post('/api/v1/robots', { description: '', authType: 1, ...robot })
  }

  /** Change a robot's name or description. */
  async updateRobot(robotId: string, robot: NewRobot): Promise<void> {
    await this.request('PUT', robotPath(robotId), robot)
  }

  /** Keep what people say of a robot that announces nothing; null forgets it. */
  async setConnectorConfig(robotId: string, connectorConfig: string | null): Promise<void> {
    await this.request('PUT', `${robotPath(robotId)}/connector-config`, { connectorConfig })
  }

  /** The tabs of original dashboards. */
  dashboardTabs(): Promise<DashboardTab[]> {
    return this.request<DashboardTab[]>('GET', '/api/v1/dashboard/tabs')
  }

  /** One of them; `widgets` is JSON in a string. */
  dashboardTab(tabId: string): Promise<DashboardTab & { widgets: string }> {
    return this.request('GET', `/api/v1/dashboard/tabs/${encodeURIComponent(tabId)}`)
  }

  /** Delete a robot; its token stops working. */
  async deleteRobot(robotId: string): Promise<void> {
    await this.request('DELETE', robotPath(robotId))
  }

  /** A new token for the robot, shown this once; the old one stops working. */
  async newRobotToken(robotId: string): Promise<string> {
    return (await this.post<{ token: string }>('/api/v1/robots/auth/simple-token', { robotId })).token
  }

  /** Every account of the organization with its role on this robot; for administrators. */
  rolesOnRobot(robotId: string): Promise<RoleOnRobot[]> {
    return this.every<RoleOnRobot>(`${robotPath(robotId)}/grants`)
  }

  /** Grant a role on this robot; null takes the grant back, so that the account's default counts again. */
  setRoleOnRobot(robotId: string, accountId: string, role: Role | null): Promise<RoleOnRobot> {
    const path = `${robotPath(robotId)}/grants/${encodeURIComponent(accountId)}`
    return role === null ? this.request('DELETE', path) : this.request('PUT', path, { role })
  }

  /** The account's organization. */
  organization(): Promise<Organization> {
    return this.request('GET', '/api/v1/organization')
  }

  /** The role of accounts that are no administrators, wherever none was granted. */
  setDefaultRole(defaultRole: Role): Promise<Organization> {
    return this.request('PUT', '/api/v1/organization', { defaultRole })
  }

  /** The short catalogue; null where the robot announced none. */
  async catalogue(robotId: string): Promise<Catalogue | null> {
    return parseCatalogue(await this.request<unknown>('GET', `${robotPath(robotId)}/catalogue`))
  }

  /** STUN and TURN servers with credentials for this account. */
  async iceServers(): Promise<IceServer[]> {
    return parseIceServers(await this.request<unknown>('GET', '/api/v1/webrtc/ice-servers'))
  }

  /** Ask for a connection; the server tells the robot to expect an offer. */
  async createConnection(robotId: string, sessionId?: string): Promise<ConnectionGrant> {
    const body = sessionId === undefined ? { robotIds: [robotId] } : { robotIds: [robotId], sessionId }
    const { sessions } = await this.post<{ sessions: ConnectionGrant[] }>('/api/v1/webrtc/connection', body)
    const grant = sessions.find((session) => session.robotId === robotId)
    if (!grant) throw new MosaicError('signal.bad_message', 'the server granted no connection')
    return grant
  }

  /** Everything behind a paged path. */
  private async every<T>(path: string): Promise<T[]> {
    const all: T[] = []
    for (;;) {
      const page = await this.request<{ data: T[]; count: number }>('GET', `${path}?skip=${all.length}&limit=100`)
      all.push(...page.data)
      if (page.data.length === 0 || all.length >= page.count) return all
    }
  }

  /** Without the token of whoever is signed in: a refusal says nothing of that session, and doesn't end it. */
  private async signIn(path: string, body: unknown): Promise<string> {
    return (await this.request<{ accessToken: string }>('POST', path, body, null)).accessToken
  }

  private post<T>(path: string, body: unknown): Promise<T> {
    return this.request<T>('POST', path, body)
  }

  private async request<T>(method: string, path: string, body?: unknown, token = this.token()): Promise<T> {
    const headers: Record<string, string> = { Accept: 'application/json' }
    if (body !== undefined) headers['Content-Type'] = 'application/json'
    if (token !== null) headers.Authorization = `Bearer ${token}`
    const init: RequestInit = { method, headers, signal: AbortSignal.timeout(TIMEOUT_MS) }
    if (body !== undefined) init.body = JSON.stringify(body)
    const response = await this.reach(path, init)
    const answer = await jsonOf(response)
    if (response.ok && !isRefusal(answer)) return resultOf(answer) as T
    const error = errorOf(response.status, answer)
    // A token of before says nothing of the session that is now.
    const isCurrent = token !== null && token === this.token()
    if (isCurrent && isEndOfSession(response.status, answer)) this.onUnauthorized(error)
    throw error
  }

  private async reach(path: string, init: RequestInit): Promise<Response> {
    try {
      return await this.fetch(this.baseUrl + path, init)
    } catch {
      throw unreachable()
    }
  }
}

function robotPath(robotId: string): string {
  return `/api/v1/robots/${encodeURIComponent(robotId)}`
}

function unreachable(): MosaicError {
  return new MosaicError('signal.unreachable', '', 'Check the network and that the server runs.')
}

async function jsonOf(response: Response): Promise<unknown> {
  const text = await response.text().catch(() => {
    throw unreachable()
  })
  try {
    return text === '' ? null : (JSON.parse(text, shown) as unknown)
  } catch {
    if (response.ok) throw new MosaicError('signal.bad_message', 'the server answered something that is not JSON')
    return null
  }
}

/** What people chose and people read; tokens, addresses and YAML stay as they came. */
const READ_BY_PEOPLE = new Set(['name', 'fullName', 'email', 'description', 'message', 'cure'])

function shown(key: string, value: unknown): unknown {
  return typeof value === 'string' && READ_BY_PEOPLE.has(key) ? plainText(value) : value
}

interface Envelope {
  resultCode?: number | string
  resultData?: unknown
  code?: string
  message?: string
  cure?: string
}

function envelopeOf(answer: unknown): Envelope | null {
  return typeof answer === 'object' && answer !== null && 'resultCode' in answer ? (answer as Envelope) : null
}

function resultOf(answer: unknown): unknown {
  const envelope = envelopeOf(answer)
  return envelope === null ? answer : envelope.resultData
}

function isRefusal(answer: unknown): boolean {
  const envelope = envelopeOf(answer)
  return envelope !== null && envelope.resultCode !== 100
}

function errorOf(status: number, answer: unknown): MosaicError {
  const envelope = envelopeOf(answer)
  const result = envelope?.resultCode === undefined ? null : reasonOfResult(envelope.resultCode)
  const code = envelope?.code ?? result ?? reasonOfStatus(status)
  const fallback = isReasonCode(code) ? '' : `the server answered ${status}`
  return new MosaicError(code, envelope?.message ?? fallback, envelope?.cure, status)
}

function reasonOfStatus(status: number): string {
  if (status === 401) return 'auth.required'
  if (status === 403) return 'auth.forbidden'
  return status === 429 ? 'signal.too_slow' : 'signal.unreachable'
}

// Original servers refuse a bad or expired token with 403 and its name.
function isEndOfSession(status: number, answer: unknown): boolean {
  return status === 401 || String(envelopeOf(answer)?.resultCode).startsWith('ACCESS_TOKEN_')
}
