/** Between the words of our wire and those of the browser's peer connection. */
import type { IceCandidate, IceServer } from '@mosaic/protocol'

export function plainIceServer({ urls, username, credential }: IceServer): RTCIceServer {
  const server: RTCIceServer = { urls: urls.map(withScheme) }
  if (username !== undefined) server.username = username
  if (credential !== undefined) server.credential = credential
  return server
}

/** Exactly our three keys. Null and the empty candidate mean "no more": there is no message for it. */
export function plainCandidate(found: RTCIceCandidate | null): IceCandidate | null {
  if (found === null || found.candidate === '') return null
  return { candidate: found.candidate, sdpMid: found.sdpMid ?? '0', sdpMLineIndex: found.sdpMLineIndex ?? 0 }
}

// Original configurations write `host:port` and mean TURN.
function withScheme(url: string): string {
  return /^(stuns?|turns?):/.test(url) ? url : `turn:${url}`
}
