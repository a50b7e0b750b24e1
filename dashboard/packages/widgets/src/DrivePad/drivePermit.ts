/** Whether this page may drive now, and if not, why, in words: who commands, the stop, the role. */
import type { LeaseView, PeerView } from '@mosaic/client'
import { nameOf, observerText } from '../control/controlText'
import type { DrivePermit, EndOfPermit } from './driveControl'

export interface DriveAuthority {
  availability: 'unknown' | 'available' | 'unavailable'
  me: PeerView | null
  isStopped: boolean
  stoppedBy: string
  /** What the connector needs to be commanded; null: it needs no lease. */
  resource: string | null
  /** Of that resource; null while the robot has not told. */
  lease: LeaseView | null
  /** The picture that leads the page is on the screen, or there is none. */
  isPictureInSight: boolean
}

export interface PermitView {
  permit: DrivePermit
  /** What ends a hold that is going on. */
  reason: EndOfPermit
  text: string
}

const GRANTED: PermitView = { permit: 'granted', reason: 'lease-lost', text: '' }

const OUT_OF_SIGHT = 'The leading picture is not on the screen: bring it back to drive'

export function drivePermit(authority: DriveAuthority): PermitView {
  const view = commandPermit(authority)
  return authority.isPictureInSight || view.permit === 'refused' ? view : refused('out-of-sight', OUT_OF_SIGHT)
}

/** What the robot lets this page do. */
function commandPermit(authority: DriveAuthority): PermitView {
  const { availability, me, isStopped, stoppedBy, resource, lease } = authority
  // An original robot knows none of this; whether the channel is open is told by the store.
  if (availability !== 'available') return GRANTED
  if (isStopped) return refused('robot-stopped', stoppedBy === '' ? 'The robot is stopped' : `Stopped by ${stoppedBy}`)
  if (me?.role === 'observer') return refused('lease-lost', observerText(me))
  if (resource === null) return GRANTED
  if (lease === null) return refused('lease-lost', 'Waiting for the robot')
  if (lease.isMine) return GRANTED
  if (lease.request?.phase === 'queued') return refused('not-granted', `Waiting for ${nameOf(lease.holder)} to hand over`)
  if (lease.state === 'free') return { permit: 'free', reason: 'lease-lost', text: 'Touch to take control' }
  // What a hold asked for went to somebody else; one that was driving lost it.
  return refused(lease.ended === null ? 'not-granted' : 'lease-lost', `${nameOf(lease.holder)} has control`)
}

function refused(reason: EndOfPermit, text: string): PermitView {
  return { permit: 'refused', reason, text }
}
