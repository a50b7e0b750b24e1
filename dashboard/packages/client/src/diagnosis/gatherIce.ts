import type { Platform } from '../platform/Platform'
import type { Gathered, GatherError, IceAnswer } from './iceAnswers'

/** A dead server is given up after this; browsers themselves take up to ten seconds. */
export const GATHER_TIMEOUT_MS = 6_000

/** What a peer connection with these servers finds; nothing is connected. Never throws for a server's sake. */
export async function gatherIce(platform: Platform, servers: readonly RTCIceServer[], relayOnly = false): Promise<IceAnswer> {
  const url = servers.flatMap(({ urls }) => urls).join(', ')
  try {
    const policy = relayOnly ? 'relay' : 'all'
    const connection = platform.openPeerConnection({ iceServers: [...servers], iceTransportPolicy: policy })
    return { url, ...(await gatheredBy(connection, platform, relayOnly)) }
  } catch (error) {
    return { url, candidates: [], errors: [], fault: error instanceof Error ? error.message : String(error) }
  }
}

async function gatheredBy(connection: RTCPeerConnection, platform: Platform, relayOnly: boolean): Promise<Omit<IceAnswer, 'url'>> {
  const candidates: Gathered[] = []
  const errors: GatherError[] = []
  const beganMs = platform.now()
  let timer: ReturnType<typeof setTimeout> | undefined
  try {
    const endedMs = await new Promise<number | undefined>((resolve, reject) => {
      const took = (): number => platform.now() - beganMs
      timer = setTimeout(() => resolve(undefined), GATHER_TIMEOUT_MS)
      connection.onicecandidate = ({ candidate }) => {
        const isEnd = candidate === null || candidate.candidate === ''
        if (!isEnd) candidates.push(gathered(candidate, took()))
        if (isEnd || (relayOnly && candidate.type === 'relay')) resolve(took())
      }
      connection.onicecandidateerror = (event) => errors.push({ code: event.errorCode, text: event.errorText })
      connection.createDataChannel('check')
      connection
        .createOffer()
        .then((offer) => connection.setLocalDescription(offer))
        .catch(reject)
    })
    return { candidates, errors, ...(endedMs === undefined ? {} : { endedMs }) }
  } finally {
    clearTimeout(timer)
    connection.onicecandidate = connection.onicecandidateerror = null
    connection.close()
  }
}

function gathered({ type, protocol, address, port }: RTCIceCandidate, atMs: number): Gathered {
  return { type: type ?? '?', protocol: protocol ?? '?', address: address ?? '', port: port ?? 0, atMs }
}
