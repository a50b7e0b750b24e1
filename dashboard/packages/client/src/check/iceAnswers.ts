/** What gathering candidates with one ICE server says about that server, about the NAT, and about this machine. */
import type { Finding, ReasonCode } from '@mosaic/protocol'
import { failed, passed, skipped, warned } from './findings'

/** A candidate as the browser tells it; `address` may be an mDNS name. */
export interface Gathered {
  type: string
  protocol: string
  address: string
  port: number
  atMs: number
}

/** An `icecandidateerror`. */
export interface GatherError {
  code: number
  text: string
}

export interface IceAnswer {
  url: string
  candidates: readonly Gathered[]
  errors: readonly GatherError[]
}

/** STUN error codes as browsers pass them on; 701 is theirs: no answer, or the name is unknown. */
const REFUSALS: Record<number, [ReasonCode, string]> = {
  400: ['ice.turn_failed', 'it does not understand the request (400)'],
  401: ['ice.turn_refused', 'it refuses user name or password (401)'],
  403: ['ice.turn_forbidden', 'it forbids an allocation (403)'],
  437: ['ice.turn_failed', 'it still has an allocation of this port (437)'],
  438: ['ice.turn_refused', 'its nonce is stale at once (438)'],
  442: ['ice.turn_failed', 'it does not relay UDP (442)'],
  486: ['ice.turn_quota', 'this account has as many allocations as it may (486)'],
  508: ['ice.turn_quota', 'it has no relay port left (508)'],
  600: ['ice.turn_tls', 'its TLS certificate is not accepted, or TCP fails (600)'],
  701: ['ice.turn_silent', 'no answer (701)'],
}

/** Browsers know no `SSL_CERT_FILE`. */
const TLS_CURE = 'Give the TURN server a certificate for this very name that browsers trust, and check that the port is the one for TLS.'

export function iceFindings(answers: readonly IceAnswer[]): Finding[] {
  if (answers.length === 0) return [warned('ice.servers', 'ice.no_servers')]
  const relays = answers.filter(({ url }) => isTurn(url))
  const works = relays.some((answer) => candidateOf(answer) !== undefined)
  const each = answers.map((answer) => (isTurn(answer.url) ? turnFinding(answer, works) : stunFinding(answer)))
  if (relays.length === 0) return [...each, warned('ice.relay', 'ice.no_turn', { sentence: 'STUN alone is known, no TURN server.' })]
  const all = works
    ? passed('ice.relay', 'Connections that find no direct path go through a TURN server.')
    : failed('ice.relay', 'ice.no_turn')
  return [...each, all]
}

function stunFinding(answer: IceAnswer): Finding {
  const { url } = answer
  const found = candidateOf(answer)
  if (found) return passed('ice.stun', `${url} answers in ${Math.round(found.atMs)} ms.`, { url, ms: Math.round(found.atMs) })
  // Without a NAT the browser leaves the reflexive candidate out: it is the host's own.
  if (answer.errors.length === 0) return passed('ice.stun', `${url} gave no address that differs from this machine's own.`, { url })
  return warned('ice.stun', 'ice.stun_silent', { sentence: `${url}: ${refusalOf(answer)[1]}.`, facts: { url } })
}

/** A dead URL beside a working one is only a warning: nobody waits for it. */
function turnFinding(answer: IceAnswer, works: boolean): Finding {
  const { url } = answer
  const found = candidateOf(answer)
  if (found) return passed('ice.turn', `${url} gives an address in ${Math.round(found.atMs)} ms.`, { url, ms: Math.round(found.atMs) })
  const [code, what] = refusalOf(answer)
  const problem = { sentence: `${url}: ${what}.`, facts: { url }, ...(code === 'ice.turn_tls' ? { cure: TLS_CURE } : {}) }
  return works ? warned('ice.turn', code, problem) : failed('ice.turn', code, problem)
}

function refusalOf({ errors }: IceAnswer): [ReasonCode, string] {
  const said = errors.find(({ code }) => code !== 701) ?? errors[0]
  if (said === undefined) return ['ice.turn_silent', 'no address within the time']
  return REFUSALS[said.code] ?? ['ice.turn_failed', `error ${said.code}${said.text === '' ? '' : ` (${said.text})`}`]
}

function candidateOf({ url, candidates }: IceAnswer): Gathered | undefined {
  return candidates.find(({ type }) => type === (isTurn(url) ? 'relay' : 'srflx'))
}

export function isTurn(url: string): boolean {
  return /^turns?:/.test(url)
}

/** Answers that one peer connection got from all servers together: only then do they speak of the same sockets. */
export function natFinding({ candidates }: Pick<IceAnswer, 'candidates'>, stunHosts: number): Finding {
  const v4 = candidates.filter(({ protocol, address }) => protocol === 'udp' && !address.includes(':'))
  const sockets = Math.max(1, v4.filter(({ type }) => type === 'host').length)
  const seen = new Set(v4.filter(({ type }) => type === 'srflx').map(({ address, port }) => `${address}:${port}`))
  const addresses = [...new Set([...seen].map((place) => place.slice(0, place.lastIndexOf(':'))))]
  const facts = { publicAddresses: addresses }
  if (stunHosts === 0) return skipped('ice.nat', 'Without a STUN server nobody tells how this machine looks from outside.')
  if (seen.size === 0) return passed('ice.nat', 'No NAT was seen: no server told another address than this machine has.', facts)
  if (stunHosts < 2) {
    const sentence = `NAT, seen from outside as ${addresses.join(' and ')}; a second STUN server would tell of what kind.`
    return warned('ice.nat', 'ice.nat_unknown', { sentence, facts })
  }
  if (seen.size > sockets) return warned('ice.nat', 'ice.nat_symmetric', { facts })
  const where = addresses.join(' and ')
  return passed('ice.nat', `NAT with one port for all destinations (endpoint-independent), seen from outside as ${where}.`, facts)
}

/** This machine's own addresses, as far as the browser tells them. */
export function addressFinding(candidates: readonly Gathered[]): Finding {
  const hosts = [...new Set(candidates.filter(({ type }) => type === 'host').map(({ address }) => address))]
  if (hosts.length === 0) return failed('network.addresses', 'ice.no_address')
  const open = hosts.filter((host) => !host.endsWith('.local'))
  if (open.length === 0) return warned('network.addresses', 'ice.mdns_only')
  return passed('network.addresses', `Addresses: ${open.join(', ')}.`, { addresses: open })
}
