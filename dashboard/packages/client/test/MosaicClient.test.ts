import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest'
import { MosaicClient, MosaicError, type RobotSummary } from '../src/index'
import { RestApi } from '../src/signaling/RestApi'
import { SessionIds } from '../src/signaling/SessionIds'
import { CATALOGUE, greeted, ROBOT, settle, signedIn } from './bench'
import { FakePlatform, FakeStorage, ok, Refused } from './fakes'

beforeEach(() => {
  vi.useFakeTimers({ toFake: ['setTimeout', 'clearTimeout', 'setInterval', 'clearInterval', 'performance', 'Date'] })
})

afterEach(() => {
  vi.useRealTimers()
})

const refused = (status: number, body: unknown) => () => {
  throw new Refused(status, body)
}

describe('signing in', () => {
  test('with a password opens the socket and lists the robots', async () => {
    const { client, platform } = await signedIn()
    expect(client.session.get()).toMatchObject({ token: 'jwt', user: { fullName: 'Ada' } })
    expect(platform.socket.url).toBe('wss://mosaic.example.org/ws/user')
    expect(platform.socket.sentOf('authorize')).toEqual([
      { accessToken: 'jwt', extensions: { catalogue: 1, multiPeer: 1 } },
    ])
    expect(client.server.get()).toBe('online')
    expect(client.robots.get().map(({ name }) => name)).toEqual(['Robbie'])
    expect(platform.socket.sentOf('status.subscribe')).toEqual([{ robotIds: [ROBOT] }])
  })

  test('with a one-time code posts the code', async () => {
    const { platform } = await signedIn()
    platform.routes['POST /api/v1/account/login/one-time'] = () => ok({ accessToken: 'once' })
    const client = new MosaicClient({ baseUrl: 'https://mosaic.example.org/', platform })
    await client.loginWithCode('ABCD')
    expect(client.session.get()?.token).toBe('once')
    expect(platform.requests.find(({ path }) => path.endsWith('one-time'))?.body).toEqual({ code: 'ABCD' })
  })

  test('refused throws what the server says', async () => {
    const { platform } = await signedIn()
    const answer = { resultCode: 'INVALID_PASSWORD', resultData: null }
    platform.routes['POST /api/v1/account/login/access-token'] = refused(400, answer)
    const client = new MosaicClient({ baseUrl: 'https://mosaic.example.org', platform })
    await expect(client.login('a', 'b')).rejects.toMatchObject({ code: 'auth.failed', httpStatus: 400 })
  })

  test('leaving forgets everything', async () => {
    const { client, platform, peer } = await greeted()
    client.logout()
    expect(client.session.get()).toBeNull()
    expect(client.sessionError.get()).toBeNull()
    expect(client.robots.get()).toEqual([])
    expect(platform.localStorage?.length).toBe(0)
    expect(platform.socket.isClosed).toBe(true)
    expect(client.connection(ROBOT).state.get().phase).toBe('closed')
    expect(peer.channel('_mosaic').controlSent().at(-1)?.type).toBe('bye')
  })
})

describe('whoever signs in after somebody else', () => {
  /** A client on which somebody has signed out while a question was open, and somebody else in; and its answer. */
  async function followed(answer: () => unknown) {
    const { client, platform } = await signedIn()
    const route = platform.routes['GET /api/v1/robots']
    let give = (): void => {}
    platform.routes['GET /api/v1/robots'] = () => new Promise((resolve) => {
      give = () => resolve(Promise.resolve().then(answer))
    })
    const asked = client.refreshRobots().catch(() => {})
    await settle()
    const answerOfBefore = give
    client.logout()
    if (route) platform.routes['GET /api/v1/robots'] = route
    platform.routes['POST /api/v1/account/login/access-token'] = () => ok({ accessToken: 'another', existingConnection: false })
    await client.login('b@b.c', 'secret')
    platform.socket.online()
    await settle()
    answerOfBefore()
    await asked
    return client
  }

  test('is not shown the robots of the one before', async () => {
    const client = await followed(() => ok({ data: [], count: 0 }))
    expect(client.robots.get().map(({ name }) => name)).toEqual(['Robbie'])
  })

  test('stays when the token of the one before is refused', async () => {
    const client = await followed(refused(401, { resultCode: 'ACCESS_TOKEN_EXPIRED', resultData: null }))
    expect(client.session.get()?.token).toBe('another')
    expect(client.sessionError.get()).toBeNull()
  })
})

describe('a remembered session', () => {
  const again = (platform: FakePlatform) => new MosaicClient({ baseUrl: 'https://mosaic.example.org', platform })

  test('is restored', async () => {
    const { platform } = await signedIn()
    const client = again(platform)
    expect(client.restoring.get()).toBe(true)
    await client.restore()
    expect(client.restoring.get()).toBe(false)
    expect(client.session.get()?.user.fullName).toBe('Ada')
  })

  test('without remember belongs to the tab', async () => {
    const { platform } = await signedIn()
    const client = again(platform)
    await client.login('a', 'b', { remember: false })
    expect(platform.localStorage?.length).toBe(0)
    platform.sessionStorage = new FakeStorage()
    expect(again(platform).restoring.get()).toBe(false)
  })

  test('that the server no longer knows ends, with the reason', async () => {
    const { platform } = await signedIn()
    platform.routes['GET /api/v1/users/me'] = refused(401, { resultCode: 'ACCESS_TOKEN_EXPIRED', resultData: null })
    const client = again(platform)
    await client.restore()
    expect(client.session.get()).toBeNull()
    expect(client.sessionError.get()).toBeInstanceOf(MosaicError)
    expect(client.sessionError.get()?.code).toBe('auth.expired')
    expect(platform.localStorage?.length).toBe(0)
  })

  test('outlives a server that is away', async () => {
    const { platform } = await signedIn()
    platform.routes['GET /api/v1/users/me'] = () => Promise.reject(new Error('network'))
    const client = again(platform)
    await client.restore()
    expect(client.sessionError.get()?.code).toBe('signal.unreachable')
    expect(platform.localStorage?.length).toBe(1)
  })

  test('that could not be checked yet is known to be there, and can be checked again', async () => {
    const { platform } = await signedIn()
    const me = platform.routes['GET /api/v1/users/me']
    platform.routes['GET /api/v1/users/me'] = () => Promise.reject(new Error('network'))
    const client = again(platform)
    await client.restore()
    expect(client.session.get()).toBeNull()
    expect(client.remembersSession).toBe(true)
    if (me !== undefined) platform.routes['GET /api/v1/users/me'] = me
    await client.restore()
    expect(client.session.get()?.user.fullName).toBe('Ada')
    expect(client.sessionError.get()).toBeNull()
    client.logout()
    expect(client.remembersSession).toBe(false)
  })

  test('works where the browser keeps nothing', async () => {
    const { platform } = await signedIn()
    platform.localStorage = platform.sessionStorage = null
    const client = again(platform)
    await client.login('a', 'b')
    expect(client.session.get()?.token).toBe('jwt')
  })
})

describe('live news', () => {
  const robot = (client: MosaicClient): RobotSummary | undefined => client.robots.get()[0]

  test('of the status change the list', async () => {
    const { client, platform } = await signedIn()
    platform.socket.says('status.update', { robotId: ROBOT, status: 5 })
    expect(robot(client)).toMatchObject({ status: 5, isOnline: false })
    const before = client.robots.get()
    platform.socket.says('status.update', { robotId: ROBOT, status: 5 })
    expect(client.robots.get()).toBe(before)
  })

  test('of the catalogue reach the connection; the same hash says nothing new', async () => {
    const { client, platform } = await signedIn()
    platform.socket.says('catalogue.update', { robotId: ROBOT, catalogue: CATALOGUE })
    const known = client.connection(ROBOT).catalogue.get()
    expect(known).toEqual(CATALOGUE)
    platform.socket.says('catalogue.update', { robotId: ROBOT, catalogue: CATALOGUE })
    expect(client.connection(ROBOT).catalogue.get()).toBe(known)
  })

  test('are asked for again after the socket was away', async () => {
    const { client, platform } = await signedIn()
    platform.socket.onclose?.({ code: 1006 })
    expect(client.server.get()).toBe('offline')
    await vi.advanceTimersByTimeAsync(500)
    platform.socket.online()
    await settle()
    expect(platform.sockets).toHaveLength(2)
    expect(platform.socket.sentOf('status.subscribe')).toEqual([{ robotIds: [ROBOT] }])
  })

  test('of an expired token end the session', async () => {
    const { client, platform } = await signedIn()
    platform.socket.onclose?.({ code: 1006 })
    platform.happens('network')
    platform.socket.onopen?.({})
    platform.socket.says('authorize.req', null)
    platform.socket.says('authorize.res', 2004)
    expect(client.session.get()).toBeNull()
    expect(client.sessionError.get()?.code).toBe('auth.expired')
  })

  test('that nobody can read are reported', async () => {
    const warn = vi.spyOn(console, 'warn').mockImplementation(() => {})
    const { client, platform } = await signedIn()
    platform.socket.onmessage?.({ data: '{' })
    platform.socket.onmessage?.({ data: new ArrayBuffer(1) })
    expect(warn).toHaveBeenCalledTimes(1)
    expect(client.server.get()).toBe('online')
    warn.mockRestore()
  })
})

describe('the REST interface', () => {
  test('takes an answer that breaks off for a server that can not be reached: that passes', async () => {
    const body = new ReadableStream({ start: (stream) => stream.error(new TypeError('network changed')) })
    const api = new RestApi('https://mosaic.example.org', () => 'jwt', () => Promise.resolve(new Response(body)), () => {})
    await expect(api.createConnection(ROBOT)).rejects.toMatchObject({ code: 'signal.unreachable' })
  })

  test('reads all pages of robots', async () => {
    const { client, platform } = await signedIn()
    const all = Array.from({ length: 3 }, (_, index) => ({ id: String(index) }))
    platform.routes['GET /api/v1/robots'] = (_body, { url }) => {
      const skip = Number(new URL(url).searchParams.get('skip'))
      return ok({ data: all.slice(skip, skip + 2), count: 3 })
    }
    expect(await client.api.robots()).toHaveLength(3)
  })

  test('gives names and messages as plain text, and what programs read as it came', async () => {
    const { client, platform } = await signedIn()
    const named = { id: 'r', name: 'Ada\u202e\n', description: 'a\nb', connectorConfig: 'a:\n  b' }
    platform.routes['GET /api/v1/robots'] = () => ok({ data: [named], count: 1 })
    const plain = { id: 'r', name: 'Ada\ufffd ', description: 'a b', connectorConfig: 'a:\n  b' }
    expect(await client.api.robots()).toMatchObject([plain])
    platform.routes['GET /api/v1/robots'] = refused(500, { resultCode: 'FAILED', resultData: null, message: 'no\u001b[2J' })
    await expect(client.api.robots()).rejects.toMatchObject({ message: expect.stringContaining('no\ufffd[2J') as string })
  })

  test('a code that is refused does not end the session of who is signed in', async () => {
    const { client, platform } = await signedIn()
    platform.routes['POST /api/v1/account/login/one-time'] = refused(401, { resultCode: 'ACCESS_DENIED', resultData: null })
    await expect(client.loginWithCode('used')).rejects.toMatchObject({ name: 'MosaicError' })
    expect(client.session.get()).not.toBeNull()
    expect(platform.requests.at(-1)?.headers.Authorization).toBeUndefined()
  })

  test('sends the token, and only what is to be sent', async () => {
    const { client, platform } = await signedIn()
    platform.routes['POST /api/v1/robots'] = () => ok({ id: 'r2', message: 'created' })
    expect(await client.api.createRobot({ name: 'Two' })).toMatchObject({ id: 'r2' })
    const request = platform.requests.at(-1)
    expect(request?.headers.Authorization).toBe('Bearer jwt')
    expect(request?.body).toEqual({ name: 'Two', description: '', authType: 1 })
  })

  test.each([
    [403, { resultCode: 'ACCESS_DENIED', resultData: null, code: 'auth.forbidden', message: 'm', cure: 'c' }, 'auth.forbidden'],
    [404, { resultCode: 'ROBOT_NOT_FOUND', resultData: null }, 'auth.unknown_robot'],
    [500, { resultCode: 10000 }, 'signal.unreachable'],
    [429, 'slow down', 'signal.too_slow'],
    [200, { resultCode: 10052, resultData: null }, 'signal.no_user_socket'],
  ])('%i %j is the error %s', async (status, body, code) => {
    const { client, platform } = await signedIn()
    platform.routes['GET /api/v1/robots/x'] = refused(status, body)
    await expect(client.api.robot('x')).rejects.toMatchObject({ name: 'MosaicError', code })
    expect(client.session.get()).not.toBeNull()
  })

  test('refuses ICE servers and catalogues that make no sense', async () => {
    const { client, platform } = await signedIn()
    platform.routes['GET /api/v1/webrtc/ice-servers'] = () => [{ urls: 3 }]
    await expect(client.api.iceServers()).rejects.toThrow('urls')
    platform.routes['GET /api/v1/robots/x/catalogue'] = () => ok({ hash: 1 })
    await expect(client.api.catalogue('x')).rejects.toThrow('hash')
  })
})

describe('session ids', () => {
  test('survive a reload, and are not copied into a duplicated tab', () => {
    const platform = new FakePlatform()
    const first = new SessionIds(platform)
    first.remember(ROBOT, 's1')
    const copy = new FakePlatform()
    copy.sessionStorage?.setItem('mosaic.sessionIds', platform.sessionStorage?.getItem('mosaic.sessionIds') ?? '{}')
    expect(new SessionIds(copy).of(ROBOT)).toBeUndefined()
    platform.happens('hide')
    const reloaded = new SessionIds(platform)
    expect(reloaded.of(ROBOT)).toBe('s1')
    expect(platform.sessionStorage?.length).toBe(0)
  })

  test('that somebody else wrote into the storage do no harm', () => {
    const platform = new FakePlatform()
    platform.sessionStorage?.setItem('mosaic.sessionIds', '{nonsense')
    expect(new SessionIds(platform).of(ROBOT)).toBeUndefined()
  })
})
