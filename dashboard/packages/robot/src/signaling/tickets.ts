/** Checks an operator's ticket: an EdDSA JWT signed by the robot's server, for this robot and this connection. */
import { plainText, type PrepareConnection, type TicketKey } from '@mosaic/protocol'

/** Phones know the time; the rest is for a server that does not quite. */
const LEEWAY_S = 60
const ROLES = ['observer', 'operator', 'supervisor'] as const

export type OperatorRole = (typeof ROLES)[number]

/** Who an operator is. `isVerified`: its ticket was checked, else it is the server's word alone. */
export interface Identity {
  account: string
  name: string
  role: OperatorRole
  isProgram: boolean
  isVerified: boolean
}

/** The browser's cryptography; `null` where the page is no secure context. */
export type Verify = ((key: Uint8Array<ArrayBuffer>, signature: Uint8Array<ArrayBuffer>, text: Uint8Array<ArrayBuffer>) => Promise<boolean>) | null

/** What is checked, and against what. */
export interface TicketCheck {
  robotId: string
  prepared: PrepareConnection
  keys: readonly TicketKey[]
  /** Seconds since 1970. */
  wallS: number
  verify: Verify
}

/** A ticket does not hold, with what is wrong with it. */
export class BadTicket extends Error {
  override readonly name = 'BadTicket'
}

/**
 * Who the operator is; throws `BadTicket`. A browser that can't check signatures takes the server's word, which came over
 * the very socket that the keys come over, and says so.
 */
export async function identityOf(check: TicketCheck): Promise<Identity> {
  const { ticket } = check.prepared
  if (ticket === undefined) throw new BadTicket('the offer came without a ticket')
  const [header, payload, signature, ...more] = ticket.split('.')
  if (header === undefined || payload === undefined || signature === undefined || more.length > 0) throw new BadTicket('it is no JWT')
  const { alg, kid } = partOf(header)
  const key = check.keys.find((one) => one.kid === kid)
  if (alg !== 'EdDSA' || key === undefined) throw new BadTicket('it is signed with a key that the server did not announce')
  const signed = new TextEncoder().encode(`${header}.${payload}`)
  const isValid = await checked(check.verify, bytesOf(key.x), bytesOf(signature), signed)
  if (isValid === false) throw new BadTicket('its signature is wrong')
  return { ...claimed(partOf(payload), check), isVerified: isValid === true }
}

/** True, false, or null where this browser knows no Ed25519. */
async function checked(verify: Verify, ...words: Parameters<NonNullable<Verify>>): Promise<boolean | null> {
  if (verify === null) return null
  try {
    return await verify(...words)
  } catch (error) {
    if (error instanceof DOMException && error.name === 'NotSupportedError') return null
    return false
  }
}

function claimed(claims: Record<string, unknown>, { robotId, prepared, wallS }: TicketCheck): Omit<Identity, 'isVerified'> {
  const expected: Record<string, string | undefined> = { robotId, peerId: prepared.rtcConnectionId, sessionId: prepared.sessionId }
  for (const [name, value] of Object.entries(expected)) {
    if (value !== undefined && textOf(claims[name]).toLowerCase() !== value.toLowerCase()) throw new BadTicket(`it is for another ${name}`)
  }
  const { exp, iat } = claims
  if (typeof exp !== 'number' || exp + LEEWAY_S < wallS) throw new BadTicket('it has expired; if this repeats, the clock of this device is wrong')
  if (typeof iat !== 'number' || iat - LEEWAY_S > wallS) throw new BadTicket('it is from the future: the clock of this device is wrong')
  const role = ROLES.find((known) => known === claims.role)
  if (role === undefined) throw new BadTicket('it names an unknown role')
  return { account: textOf(claims.sub), name: plainText(textOf(claims.name)), role, isProgram: claims.program === true }
}

function textOf(value: unknown): string {
  return typeof value === 'string' ? value : ''
}

function partOf(text: string): Record<string, unknown> {
  try {
    const value: unknown = JSON.parse(new TextDecoder().decode(bytesOf(text)))
    if (typeof value === 'object' && value !== null) return value as Record<string, unknown>
  } catch (error) {
    if (!(error instanceof SyntaxError || error instanceof DOMException)) throw error
  }
  throw new BadTicket('it is not readable')
}

/** Base64url, without padding. */
function bytesOf(text: string): Uint8Array<ArrayBuffer> {
  try {
    return Uint8Array.from(atob(text.replaceAll('-', '+').replaceAll('_', '/')), (char) => char.charCodeAt(0))
  } catch {
    throw new BadTicket('it is not readable')
  }
}

/** The browser's own; null where the page is no secure context. */
export function browserVerify(): Verify {
  // eslint-disable-next-line no-restricted-properties -- what is missing is said
  const subtle = globalThis.isSecureContext ? crypto.subtle : null
  if (subtle === null) return null
  return async (raw, signature, text) => {
    const key = await subtle.importKey('raw', raw, { name: 'Ed25519' }, false, ['verify'])
    return subtle.verify({ name: 'Ed25519' }, key, signature, text)
  }
}
