/** Between the words of our wire and those of the browser's peer connection. */
import type { IceCandidate } from '@mosaic/protocol'

/** Exactly our three keys. Null and the empty candidate mean "no more": there is no message for it. */
export function plainCandidate(found: RTCIceCandidate | null): IceCandidate | null {
  if (found === null || found.candidate === '') return null
  return { candidate: found.candidate, sdpMid: found.sdpMid ?? '0', sdpMLineIndex: found.sdpMLineIndex ?? 0 }
}
