import { beforeAll, expect, test } from 'vitest'
import { webcrypto } from 'node:crypto'
import { BadTicket, identityOf, type TicketCheck, type Verify } from '../src/signaling/tickets'

const NOW_S = 1_800_000_000
const CLAIMS = { sub: 'ada-id', name: 'Ada', role: 'supervisor', program: false, robotId: 'ROBOT', peerId: 'peer', sessionId: 'session', iat: NOW_S, exp: NOW_S + 300 }

const { subtle } = webcrypto
let keys: webcrypto.CryptoKeyPair
let x = ''

const verify: Verify = async (raw, signature, text) => {
  const key = await subtle.importKey('raw', raw, { name: 'Ed25519' }, false, ['verify'])
  return subtle.verify({ name: 'Ed25519' }, key, signature, text)
}

beforeAll(async () => {
  keys = (await subtle.generateKey({ name: 'Ed25519' }, true, ['sign', 'verify'])) as webcrypto.CryptoKeyPair
  x = base64url(new Uint8Array(await subtle.exportKey('raw', keys.publicKey)))
})

function base64url(bytes: Uint8Array): string {
  return Buffer.from(bytes).toString('base64url')
}

async function ticket(claims: object = {}, header: object = {}): Promise<string> {
  const parts = [{ alg: 'EdDSA', kid: 'k1', ...header }, { ...CLAIMS, ...claims }].map((part) => base64url(Buffer.from(JSON.stringify(part))))
  const text = parts.join('.')
  return `${text}.${base64url(new Uint8Array(await subtle.sign({ name: 'Ed25519' }, keys.privateKey, Buffer.from(text))))}`
}

function check(signed: string | undefined, change: Partial<TicketCheck> = {}): TicketCheck {
  const prepared = { rtcConnectionId: 'peer', sessionId: 'session', ...(signed === undefined ? {} : { ticket: signed }) }
  return { robotId: 'robot', prepared, keys: [{ kid: 'k1', x }], wallS: NOW_S + 1, verify, ...change }
}

test('a ticket says who comes, and it was checked', async () => {
  const identity = await identityOf(check(await ticket()))
  expect(identity).toEqual({ account: 'ada-id', name: 'Ada', role: 'supervisor', isProgram: false, isVerified: true })
})

test('a browser that can not check takes the word of the server, and says so', async () => {
  const unable: Verify = () => Promise.reject(new DOMException('', 'NotSupportedError'))
  for (const verify of [null, unable]) expect(await identityOf(check(await ticket(), { verify }))).toMatchObject({ name: 'Ada', isVerified: false })
})

test.each([
  ['another robot', { robotId: 'other' }, 'robotId'],
  ['another connection', { peerId: 'other' }, 'peerId'],
  ['another session', { sessionId: 'other' }, 'sessionId'],
  ['the past', { exp: NOW_S - 100 }, 'expired'],
  ['the future', { iat: NOW_S + 100 }, 'future'],
  ['a role that nobody knows', { role: 'king' }, 'role'],
  ['no time', { exp: undefined }, 'expired'],
])('a ticket for %s does not hold', async (_what, claims, why) => {
  await expect(identityOf(check(await ticket(claims)))).rejects.toThrow(why)
})

test('a ticket of another key, another algorithm, or changed after it was signed does not hold', async () => {
  const good = await ticket()
  const [header = '', , signature = ''] = good.split('.')
  const forged = [header, base64url(Buffer.from(JSON.stringify({ ...CLAIMS, name: 'Eve' }))), signature].join('.')
  const bad = [await ticket({}, { kid: 'k2' }), await ticket({}, { alg: 'none' }), forged, `${good}.more`, 'a.b', 'ä.ö.ü', '', undefined]
  for (const one of bad) await expect(identityOf(check(one))).rejects.toThrow(BadTicket)
})
