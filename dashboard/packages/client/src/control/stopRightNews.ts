import type { ControlEvent, PeerView } from '../words/views'

/** From whom a supervisor took the right to say stop, or to whom it came back, between two lists of who is here. */
export function stopRightNews(before: readonly PeerView[], now: readonly PeerView[]): ControlEvent[] {
  const could = new Map(before.map((peer) => [peer.peerId, mayStop(peer)]))
  return now
    .filter((peer) => could.has(peer.peerId) && could.get(peer.peerId) !== mayStop(peer))
    .map((of) => ({ type: 'stopRight', of, mayStop: mayStop(of), by: of.stopRightBy ?? '' }))
}

function mayStop(peer: PeerView): boolean {
  return peer.mayStop !== false
}
