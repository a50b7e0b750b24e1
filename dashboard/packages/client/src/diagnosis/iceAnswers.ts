/** What gathering candidates with one ICE server says about that server, about the NAT, and about this machine. */
import type { Finding, ReasonCode } from '@mosaic/protocol'
import { isTurn, type UnusableIceServer } from '../words/iceServers'
import { failed, passed, skipped, told, warned } from './findings'

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
  /** When the browser was done with it; absent where it was still waiting at the end. */
  endedMs?: number
  /** Why the browser did not even ask. */
  fault?: string
}

/** A STUN server that is there answers at once, or the second time it is asked. */
const ANSWERED_MS = 3000

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

/** `unusable`: those that are left out of every connection. */
export function iceFindings(answers: readonly IceAnswer[], unusable: readonly UnusableIceServer[] = []): Finding[] {
  if (answers.length + unusable.length === 0) return [warned('ice.servers', 'ice.no_servers')]
  const relays = [...answers, ...unusable].filter(({ url }) => isTurn(url))
  const works = answers.some((answer) => isTurn(answer.url) && candidateOf(answer) !== undefined)
  const each = [
    ...unusable.map((server) => unusableFinding(server, works)),
    ...answers.map((answer) => (isTurn(answer.url) ? turnFinding(answer, works) : stunFinding(answer))),
  ]
  if (relays.length === 0) return [...each, warned('ice.relay', 'ice.no_turn', { sentence: 'STUN alone is known, no TURN server.' })]
  const all = works
    ? passed('ice.relay', 'Connections that find no direct path go through a TURN server.')
    : failed('ice.relay', 'ice.no_turn')
  return [...each, all]
}

function unusableFinding({ url, code, problem }: UnusableIceServer, works: boolean): Finding {
  const what = { sentence: `${url} is left out: ${problem}.`, facts: { url } }
  if (!isTurn(url)) return warned('ice.stun', code, what)
  return works ? warned('ice.turn', code, what) : failed('ice.turn', code, what)
}

function stunFinding(answer: IceAnswer): Finding {
  const { url } = answer
  const found = candidateOf(answer)
  if (found) return passed('ice.stun', `${url} answers in ${Math.round(found.atMs)} ms.`, { url, ms: Math.round(found.atMs) })
  // Without a NAT the browser leaves the reflexive candidate out: it is the host's own.
  if (hasAnswered(answer)) return passed('ice.stun', `${url} answers: it sees the address that this machine has itself.`, { url })
  const [code, what] = answer.fault === undefined ? (['ice.stun_silent', refusalOf(answer)[1]] as const) : refusalOf(answer)
  return warned('ice.stun', code, { sentence: `${url}: ${what}.`, facts: { url } })
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

function refusalOf({ errors, fault }: IceAnswer): [ReasonCode, string] {
  if (fault !== undefined) return ['check.no_peer_connection', `the browser says: ${fault}`]
  const said = errors.find(({ code }) => code !== 701) ?? errors[0]
  if (said === undefined) return ['ice.turn_silent', 'no answer within the time']
  return REFUSALS[said.code] ?? ['ice.turn_failed', `error ${said.code}${said.text === '' ? '' : ` (${said.text})`}`]
}

function candidateOf({ url, candidates }: IceAnswer): Gathered | undefined {
  return candidates.find(({ type }) => type === (isTurn(url) ? 'relay' : 'srflx'))
}

/** Whether it told how this machine looks from outside; the browser says nothing of an address that the machine has itself. */
export function hasAnswered(answer: IceAnswer): boolean {
  if (candidateOf(answer) !== undefined) return true
  const { url, errors, endedMs = Infinity } = answer
  return !isTurn(url) && errors.length === 0 && endedMs < ANSWERED_MS
}

/** `stunHosts`: of how many different servers an answer came. Answers that one peer connection got from all servers together: only then do they speak of the same sockets. */
export function natFinding({ candidates }: Pick<IceAnswer, 'candidates'>, stunHosts: number): Finding {
  const v4 = candidates.filter(({ protocol, address }) => protocol === 'udp' && !address.includes(':'))
  const sockets = Math.max(1, v4.filter(({ type }) => type === 'host').length)
  const seen = new Set(v4.filter(({ type }) => type === 'srflx').map(({ address, port }) => `${address}:${port}`))
  const addresses = [...new Set([...seen].map((place) => place.slice(0, place.lastIndexOf(':'))))]
  const facts = { publicAddresses: addresses }
  if (stunHosts === 0) return skipped('ice.nat', 'Without the answer of a STUN server nobody tells how this machine looks from outside.')
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
export function addressFinding({ candidates, fault }: Pick<IceAnswer, 'candidates' | 'fault'>): Finding {
  if (fault !== undefined) return failed('network.addresses', 'check.no_peer_connection', { sentence: `The browser makes no peer connection: ${fault}` })
  const hosts = [...new Set(candidates.filter(({ type }) => type === 'host').map(({ address }) => address))]
  if (hosts.length === 0) return failed('network.addresses', 'ice.no_address')
  const open = hosts.filter((host) => !host.endsWith('.local'))
  // So do all browsers that were not allowed microphone or camera: nothing is wrong.
  if (open.length === 0) return told('network.addresses', 'ice.mdns_only')
  return passed('network.addresses', `Addresses: ${open.join(', ')}.`, { addresses: open })
}
