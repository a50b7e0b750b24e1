/** Who is connected, in the order that matters: who drives, then people, then programs. */
import type { LeaseView, PeerView } from '@mosaic/client'
import { nameOf, roleText, takerOf } from './controlText'

export interface Present {
  peerId: string
  name: string
  /** What it commands; empty: it watches. */
  drives: readonly string[]
  role: string
  isPerson: boolean
  isMe: boolean
  /** False: a supervisor has taken from this observer the right to say stop. */
  mayStop: boolean
  /** Who took that right; empty while it was not. */
  stopTakenBy: string
}

/** Two accounts that are called alike are told apart by the beginning of their ids. */
function toldApart(peer: PeerView, peers: readonly PeerView[]): string {
  const name = nameOf(peer)
  const isTaken = peers.some((other) => other.account !== peer.account && !other.isMe && nameOf(other) === name)
  return isTaken && peer.account !== undefined ? `${name} (${peer.account.slice(0, SHOWN_ID)})` : name
}

const SHOWN_ID = 8

export function presentOf(peers: readonly PeerView[], leases: Readonly<Record<string, LeaseView>>): Present[] {
  const drives = ({ peerId }: PeerView) =>
    Object.values(leases)
      .filter(({ holder }) => holder?.peerId === peerId)
      .map(({ resource }) => resource)
  return peers
    .map((peer) => ({
      peerId: peer.peerId,
      name: toldApart(peer, peers),
      drives: drives(peer),
      role: roleText(peer.role),
      isPerson: peer.isPerson,
      isMe: peer.isMe,
      mayStop: peer.mayStop !== false,
      stopTakenBy: peer.mayStop === false ? takerOf(peer) : '',
    }))
    .sort((one, other) => rank(one) - rank(other) || one.name.localeCompare(other.name))
}

function rank({ drives, isPerson, isMe }: Present): number {
  if (drives.length > 0) return 0
  if (isMe) return 1
  return isPerson ? 2 : 3
}

/** `Driving: Alice. Watching: You, Bob.` */
export function presenceSentence(present: readonly Present[]): string {
  const names = (those: readonly Present[]) => those.map(({ name }) => name).join(', ')
  const driving = present.filter(({ drives }) => drives.length > 0)
  const watching = present.filter(({ drives }) => drives.length === 0)
  const parts = [
    `Driving: ${driving.length === 0 ? 'nobody' : names(driving)}.`,
    watching.length === 0 ? '' : `Watching: ${names(watching)}.`,
  ]
  return parts.filter(Boolean).join(' ')
}
