import type { IceServer } from '@mosaic/protocol'
import type { Platform } from '../Platform'
import type { Gathered, GatherError, IceAnswer } from './iceAnswers'

/** A dead server is given up after this; browsers themselves take up to ten seconds. */
export const GATHER_TIMEOUT_MS = 6_000

/** What a peer connection with these servers finds; nothing is connected. Never throws for a server's sake. */
export async function gatherIce(platform: Platform, servers: readonly IceServer[], relayOnly = false): Promise<IceAnswer> {
  const candidates: Gathered[] = []
  const errors: GatherError[] = []
  const url = servers.flatMap(({ urls }) => urls).join(', ')
  let connection: RTCPeerConnection
  try {
    const policy = relayOnly ? 'relay' : 'all'
    connection = platform.openPeerConnection({ iceServers: servers.map(plain), iceTransportPolicy: policy })
  } catch (error) {
    return { url, candidates, errors: [{ code: 0, text: error instanceof Error ? error.message : String(error) }] }
  }
  const beganMs = platform.now()
  let timer: ReturnType<typeof setTimeout> | undefined
  try {
    await new Promise<void>((resolve, reject) => {
      timer = setTimeout(resolve, GATHER_TIMEOUT_MS)
      connection.onicecandidate = ({ candidate }) => {
        if (candidate === null || candidate.candidate === '') {
          resolve()
          return
        }
        candidates.push(gathered(candidate, platform.now() - beganMs))
        if (relayOnly && candidate.type === 'relay') resolve()
      }
      connection.onicecandidateerror = (event) => errors.push({ code: event.errorCode, text: event.errorText })
      connection.createDataChannel('check')
      connection
        .createOffer()
        .then((offer) => connection.setLocalDescription(offer))
        .catch(reject)
    })
  } catch (error) {
    errors.push({ code: 0, text: error instanceof Error ? error.message : String(error) })
  } finally {
    clearTimeout(timer)
    connection.onicecandidate = connection.onicecandidateerror = null
    connection.close()
  }
  return { url, candidates, errors }
}

function gathered({ type, protocol, address, port }: RTCIceCandidate, atMs: number): Gathered {
  return { type: type ?? '?', protocol: protocol ?? '?', address: address ?? '', port: port ?? 0, atMs }
}

function plain({ urls, username, credential }: IceServer): RTCIceServer {
  return { urls: [...urls], ...(username === undefined ? {} : { username }), ...(credential === undefined ? {} : { credential }) }
}
