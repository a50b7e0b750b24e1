import { REASONS, type Finding } from '@mosaic/protocol'
import fc from 'fast-check'
import { describe, expect, test } from 'vitest'
import { browserFindings, type Abilities } from '../../src/diagnosis/browserFindings'
import { clockFinding, clockSkew } from '../../src/diagnosis/clockSkew'
import { checkConnection } from '../../src/diagnosis/checkConnection'
import { addressFinding, hasAnswered, iceFindings, natFinding, type Gathered, type IceAnswer } from '../../src/diagnosis/iceAnswers'
import { MosaicError } from '../../src/words/MosaicError'
import { sortedIceServers } from '../../src/words/iceServers'
import type { Platform } from '../../src/platform/Platform'
import type { RestApi } from '../../src/signaling/RestApi'

const TURN = 'turn:turn.example.org:3478'
const STUN = 'stun:stun.example.org:3478'

function candidate(type: string, address = '198.51.100.7', port = 5000): Gathered {
  return { type, protocol: 'udp', address, port, atMs: 42 }
}

function answer(url: string, given: Partial<IceAnswer> = {}): IceAnswer {
  return { url, candidates: [], errors: [], ...given }
}

function codes(findings: readonly Finding[]): string[] {
  return findings.map(({ check, status, code }) => `${check} ${status} ${code}`)
}

describe('ICE servers', () => {
  test('a relayed address is what a TURN server is for', () => {
    expect(codes(iceFindings([answer(TURN, { candidates: [candidate('relay')] })]))).toEqual(['ice.turn ok check.ok', 'ice.relay ok check.ok'])
  })

  test.each([
    [401, 'ice.turn_refused'],
    [486, 'ice.turn_quota'],
    [508, 'ice.turn_quota'],
    [437, 'ice.turn_failed'],
    [701, 'ice.turn_silent'],
    [999, 'ice.turn_failed'],
  ])('error %i is explained', (code, reason) => {
    const [turn, relay] = iceFindings([answer(TURN, { errors: [{ code, text: '' }] })])
    expect(turn).toMatchObject({ status: 'fail', code: reason })
    expect(turn?.sentence).toContain(TURN)
    expect(relay).toMatchObject({ status: 'fail', code: 'ice.no_turn' })
  })

  test('what the server says counts more than a lost packet', () => {
    const errors = [
      { code: 701, text: '' },
      { code: 401, text: 'Unauthorized' },
    ]
    expect(iceFindings([answer(TURN, { errors })])[0]?.code).toBe('ice.turn_refused')
  })

  test('a dead URL beside a working one is a warning: nobody waits for it', () => {
    const found = iceFindings([answer(TURN), answer(`${TURN}?transport=tcp`, { candidates: [candidate('relay')] })])
    expect(found.map(({ status }) => status)).toEqual(['warn', 'ok', 'ok'])
  })

  test('none at all, or STUN alone, is said', () => {
    expect(codes(iceFindings([]))).toEqual(['ice.servers warn ice.no_servers'])
    expect(codes(iceFindings([answer(STUN, { candidates: [candidate('srflx')] })]))[1]).toBe('ice.relay warn ice.no_turn')
  })
})

describe('NAT', () => {
  const host = candidate('host', '192.168.1.2', 4000)

  test('one outer port for all servers is a NAT that lets peers in', () => {
    expect(natFinding({ candidates: [host, candidate('srflx')] }, 2)).toMatchObject({ status: 'ok', facts: { publicAddresses: ['198.51.100.7'] } })
  })

  test('another port for each server is a symmetric one', () => {
    const candidates = [host, candidate('srflx'), candidate('srflx', '198.51.100.7', 5001)]
    expect(natFinding({ candidates }, 2).code).toBe('ice.nat_symmetric')
  })

  test('two interfaces have two outer ports, and no symmetric NAT', () => {
    const candidates = [host, candidate('host', '10.0.0.2'), candidate('srflx'), candidate('srflx', '203.0.113.9')]
    expect(natFinding({ candidates }, 2).status).toBe('ok')
  })

  test('one server alone can not tell the kind; none tells nothing', () => {
    expect(natFinding({ candidates: [host, candidate('srflx')] }, 1).code).toBe('ice.nat_unknown')
    expect(natFinding({ candidates: [host] }, 0).status).toBe('skipped')
    expect(natFinding({ candidates: [host] }, 2).status).toBe('ok')
  })
})

test('addresses hidden behind names are told, none at all is a failure, and a browser that refuses is another one', () => {
  expect(addressFinding({ candidates: [candidate('host', '192.168.1.2')] }).status).toBe('ok')
  expect(addressFinding({ candidates: [] }).code).toBe('ice.no_address')
  const refused = addressFinding({ candidates: [], fault: 'too many of them' })
  expect(refused).toMatchObject({ status: 'fail', code: 'check.no_peer_connection' })
  expect(refused.sentence).toContain('too many of them')
})

test('hidden addresses are how a browser is: nothing to do, and said all the same', () => {
  const found = addressFinding({ candidates: [candidate('host', 'abcd.local')] })
  expect(found).toMatchObject({ status: 'ok', code: 'ice.mdns_only', cure: '' })
  expect(found.sentence).toContain('microphone')
})

describe('a STUN server', () => {
  const silent = { status: 'warn', code: 'ice.stun_silent' }

  test('that sees the own address of this machine has answered', () => {
    const [stun] = iceFindings([answer(STUN, { endedMs: 40 })])
    expect(stun).toMatchObject({ status: 'ok' })
    expect(stun?.sentence).toContain('answers')
  })

  test.each([
    ['was still awaited at the end', {}],
    ['was given up by the browser without a word', { endedMs: 5000 }],
    ['is an error', { endedMs: 40, errors: [{ code: 701, text: '' }] }],
  ])('that %s is silent', (_name, given) => {
    expect(iceFindings([answer(STUN, given)])[0]).toMatchObject(silent)
  })

  test('that never answered tells nothing of the NAT', () => {
    expect(hasAnswered(answer(STUN))).toBe(false)
    expect(hasAnswered(answer(STUN, { endedMs: 40 }))).toBe(true)
    expect(hasAnswered(answer(TURN, { endedMs: 40 }))).toBe(false)
    expect(hasAnswered(answer(TURN, { candidates: [candidate('relay')] }))).toBe(true)
  })
})

test('servers that a browser does not take are named, with why they are left out', () => {
  const { unusable } = sortedIceServers([{ urls: [TURN] }, { urls: ['stun:a b'] }])
  expect(codes(iceFindings([], unusable))).toEqual([
    'ice.turn fail ice.turn_no_credentials',
    'ice.stun warn ice.bad_url',
    'ice.relay fail ice.no_turn',
  ])
  expect(iceFindings([], unusable)[0]?.sentence).toBe(`${TURN} is left out: user name or password is missing.`)
  const relay = answer(`${TURN}?transport=tcp`, { candidates: [candidate('relay')] })
  expect(codes(iceFindings([relay], unusable))[0]).toBe('ice.turn warn ice.turn_no_credentials')
})

test('clocks that agree are fine whatever the way there takes; far ones are said with their direction', () => {
  expect(clockFinding(clockSkew(10_000, 10_200, 10_000)).status).toBe('ok')
  expect(clockFinding(clockSkew(100_000, 100_200, 10_000)).sentence).toBe("This machine's clock is 90 s ahead of the server's.")
  expect(clockFinding(clockSkew(10_000, 10_200, 100_000)).sentence).toContain('behind')
  fc.assert(
    fc.property(fc.integer({ min: -4000, max: 3000 }), fc.integer({ min: 0, max: 5000 }), (offMs, tripMs) => {
      const serverMs = 1_000_000 + tripMs / 2 - offMs
      return clockFinding(clockSkew(1_000_000, 1_000_000 + tripMs, Math.floor(serverMs / 1000) * 1000)).status === 'ok'
    }),
  )
})

const ABLE: Abilities = {
  hasWebRtc: true,
  isSecure: true,
  microphone: 'prompt',
  hasGamepads: true,
  videoCodecs: ['video/VP8', 'video/H264'],
  hasVideoDecoder: true,
}

test('an able browser has nothing to complain of; each missing thing has its code', () => {
  expect(browserFindings(ABLE).every(({ status }) => status === 'ok')).toBe(true)
  const found = codes(browserFindings({ ...ABLE, isSecure: false, hasGamepads: false, videoCodecs: ['video/VP8'] }))
  expect(found).toContain('browser.secure warn check.insecure_page')
  expect(found).toContain('browser.microphone warn check.no_microphone')
  expect(found).toContain('browser.gamepad warn check.no_gamepad')
  expect(found).toContain('browser.decoders warn check.no_decoder')
  expect(codes(browserFindings({ ...ABLE, videoCodecs: [] }))).toContain('browser.decoders fail check.no_decoder')
  expect(codes(browserFindings({ ...ABLE, hasWebRtc: false }))[0]).toBe('browser.webrtc fail check.no_webrtc')
})

test('whatever is missing, what to do is said', () => {
  const unable = { hasWebRtc: false, isSecure: false, microphone: 'denied', hasGamepads: false, hasVideoDecoder: false }
  const found = [[], ['video/VP8'], ['video/H264']].flatMap((videoCodecs) => [
    ...browserFindings({ ...ABLE, ...unable, videoCodecs }),
    ...browserFindings({ ...ABLE, videoCodecs }),
  ])
  for (const code of [400, 401, 403, 437, 438, 442, 486, 508, 600, 701, 999]) {
    found.push(...iceFindings([{ url: 'turns:a:1?transport=tcp', candidates: [], errors: [{ code, text: '' }] }]))
  }
  const bad = found.filter(({ status }) => status === 'warn' || status === 'fail')
  expect(bad.length).toBeGreaterThan(20)
  expect(bad.filter(({ cure }) => cure === '')).toEqual([])
})

describe('the whole check', () => {
  const platform = { now: () => 0, openPeerConnection: () => { throw new Error('none') } } as unknown as Platform // prettier-ignore

  async function checked(api: Partial<RestApi>, server: 'online' | 'offline' = 'online'): Promise<Finding[]> {
    const found: Finding[] = []
    const around = { platform, api: api as RestApi, server: () => server, abilities: () => Promise.resolve(ABLE) }
    await checkConnection(around, (finding) => found.push(finding))
    expect(found.every(({ code }) => Object.hasOwn(REASONS, code))).toBe(true)
    return found
  }

  test('a server that is away is named alone', async () => {
    const away = () => Promise.reject(new MosaicError('signal.unreachable'))
    const found = codes(await checked({ introduction: away, iceServers: away }))
    expect(found.filter((one) => /^(server|ice\.)/.test(one) && !one.includes(' skipped '))).toEqual(['server.http fail signal.unreachable'])
  })

  test('a server that answers nothing is one finding, and no exception', async () => {
    const found = await checked({ introduction: () => Promise.reject(new Error('down')), iceServers: () => Promise.reject(new Error('down')) })
    expect(codes(found)).toContain('server.http fail signal.unreachable')
    expect(codes(found)).toContain('ice.servers fail signal.bad_message')
  })

  test('a server that answers is told with its version, and a closed socket beside it', async () => {
    const info = { name: 'mosaic-server', version: '0.1.0', extensions: { catalogue: 1 }, signup: false }
    const found = await checked({ introduction: () => Promise.resolve({ info, dateMs: null }), iceServers: () => Promise.resolve([]) }, 'offline')
    expect(found.find(({ check }) => check === 'server.http')?.sentence).toContain('mosaic-server 0.1.0')
    expect(codes(found)).toContain('server.websocket fail signal.no_websocket')
    expect(codes(found)).toContain('network.addresses fail check.no_peer_connection')
  })

  test('what a browser says of an ICE server is not taken for a machine without addresses', async () => {
    const credentials = { username: 'u', credential: 'c' }
    const found = await checked({
      introduction: () => Promise.reject(new Error('down')),
      iceServers: () => Promise.resolve([{ urls: [TURN], ...credentials }, { urls: ['turns:other.example.org'] }]),
    })
    expect(codes(found)).not.toContain('network.addresses fail ice.no_address')
    expect(codes(found)).toContain('ice.turn fail check.no_peer_connection')
    expect(codes(found)).toContain('ice.turn fail ice.turn_no_credentials')
    expect(codes(found).find((one) => one.startsWith('ice.nat'))).toBe('ice.nat skipped check.skipped')
  })
})
