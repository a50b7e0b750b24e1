/** The operator's half of `mosaic doctor`: this browser, the server, ICE. Needs no robot, connects to none. */
import type { Finding } from '@mosaic/protocol'
import { wallClockMs } from '../timing/clock'
import { MosaicError } from '../words/MosaicError'
import { isTurn, sortedIceServers } from '../words/iceServers'
import type { Platform } from '../platform/Platform'
import type { RestApi } from '../signaling/RestApi'
import type { ServerState } from '../words/types'
import { browserFindings, type Abilities } from './browserFindings'
import { clockFinding, clockSkew } from './clockSkew'
import { failed, passed, skipped, warned } from './findings'
import { gatherIce } from './gatherIce'
import { addressFinding, hasAnswered, iceFindings, natFinding, type IceAnswer } from './iceAnswers'

/** From here on the set-up alone, five round trips, is felt. */
const FAR_MS = 300
const ROUND_TRIPS = 3

export interface CheckSurroundings {
  platform: Platform
  api: RestApi
  /** The state of the socket on which connections are set up. */
  server: () => ServerState
  abilities: () => Promise<Abilities>
}

/** Everything, side by side; `found` hears of each finding as it comes. Takes about six seconds with dead servers. */
export async function checkConnection(around: CheckSurroundings, found: (finding: Finding) => void): Promise<void> {
  const abilities = await around.abilities()
  browserFindings(abilities).forEach(found)
  await Promise.all([checkServer(around, found), abilities.hasWebRtc ? checkIce(around, found) : undefined])
}

async function checkServer({ platform, api, server }: CheckSurroundings, found: (finding: Finding) => void): Promise<void> {
  let bestMs = Infinity
  for (let round = 0; round < ROUND_TRIPS; round += 1) {
    const [askedAtMs, askedWallMs] = [platform.now(), wallClockMs()]
    try {
      const { info, dateMs } = await api.introduction()
      bestMs = Math.min(bestMs, platform.now() - askedAtMs)
      if (round > 0) continue
      found(passed('server.http', `${info.name} ${info.version} answers; extensions: ${Object.keys(info.extensions).join(', ')}.`, { version: info.version }))
      if (dateMs !== null) found(clockFinding(clockSkew(askedWallMs, wallClockMs(), dateMs)))
    } catch (error) {
      const sentence = error instanceof MosaicError ? error.message : String(error)
      found(failed('server.http', 'signal.unreachable', { sentence }))
      return
    }
  }
  found(roundTrip(bestMs))
  found(
    server() === 'online'
      ? passed('server.websocket', 'The WebSocket to the server is open.')
      : failed('server.websocket', 'signal.no_websocket'),
  )
}

function roundTrip(ms: number): Finding {
  const facts = { roundTripMs: Math.round(ms * 10) / 10 }
  const sentence = `The server answers within ${ms < 10 ? ms.toFixed(1) : Math.round(ms)} ms.`
  return ms > FAR_MS ? warned('server.round_trip', 'check.far_server', { sentence, facts }) : passed('server.round_trip', sentence, facts)
}

async function checkIce({ platform, api }: CheckSurroundings, found: (finding: Finding) => void): Promise<void> {
  const servers = await api.iceServers().catch((error: unknown) => {
    found(unknownServers(error))
    return null
  })
  const { usable, unusable } = sortedIceServers(servers ?? [])
  const [together, ...answers] = await Promise.all([
    gatherIce(platform, usable),
    ...usable.map((server) => gatherIce(platform, [server], [server.urls].flat().some(isTurn))),
  ])
  found(addressFinding(together))
  if (usable.length > 0) found(natFinding(together, stunHosts(answers)))
  if (servers !== null) iceFindings(answers, unusable).forEach(found)
}

/** That the server is away has been said already, and is all that is wrong. */
function unknownServers(error: unknown): Finding {
  const sentence = `The server's ICE servers are unknown: ${error instanceof Error ? error.message : String(error)}`
  const isAway = error instanceof MosaicError && error.code === 'signal.unreachable'
  return isAway ? skipped('ice.servers', sentence) : failed('ice.servers', 'signal.bad_message', { sentence })
}

/** Different servers that told how a UDP socket looks from outside. */
function stunHosts(answers: readonly IceAnswer[]): number {
  const overUdp = answers.filter(({ url }) => url.startsWith('stun:') || (url.startsWith('turn:') && !url.includes('transport=tcp')))
  return new Set(overUdp.filter(hasAnswered).map(({ url }) => url.replace(/\?.*$/, '').replace(/^\w+:/, ''))).size
}
