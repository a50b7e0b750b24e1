import type { ControlMessages } from '@mosaic/protocol'
import type { RobotPeer } from './RobotPeer'

/** An operator who is here. */
export interface Viewer {
  id: string
  name: string
  role: string
  isVerified: boolean
  labels: readonly string[]
}

/** Keeps the peers of one robot, and tells those who are connected what concerns them all. */
export class PeersHere {
  private readonly peers = new Map<string, RobotPeer>()

  add(peer: RobotPeer): void {
    this.peers.set(peer.id, peer)
  }

  delete(peerId: string): void {
    this.peers.delete(peerId)
  }

  get(peerId: string): RobotPeer | undefined {
    return this.peers.get(peerId)
  }

  closeAll(code: string): void {
    for (const peer of [...this.peers.values()]) peer.close(code)
  }

  tell<T extends keyof ControlMessages>(type: T, data: ControlMessages[T]): void {
    for (const peer of this.open()) peer.send(type, data)
  }

  /** Everybody hears who is here. */
  tellPeers(): void {
    const open = this.open()
    const peers = open.map(({ info }) => info)
    for (const peer of open) peer.send('peers', { you: peer.id, peers })
  }

  /** How the page shows them. */
  viewers(): Viewer[] {
    return this.open().map(({ id, identity, watched }) => {
      return { id, name: identity.name, role: identity.role, isVerified: identity.isVerified, labels: watched }
    })
  }

  private open(): RobotPeer[] {
    return [...this.peers.values()].filter(({ isOpen }) => isOpen)
  }
}
