/** Whether a message of this page may leave for a connector, and under which epoch. Pure. */
import type { CatalogueEntry } from '@mosaic/protocol'
import type { Availability, LeaseView, PeerView, SendBlock } from '../words/views'

/** `epoch` goes into the frame; with a `block` nothing may leave. */
export interface Clearance {
  epoch: number
  block: SendBlock | null
}

export interface Standing {
  availability: Availability
  isStopped: boolean
  me: PeerView | null
  /** Of the connector's resource. */
  lease: LeaseView
  epoch: number
}

const OPEN: Clearance = { epoch: 0, block: null }
const DEFAULT_RESOURCE = 'motion'

/** The resource whose lease commands for this connector need; null: they need none. */
export function resourceOf(entry: CatalogueEntry | null): string | null {
  const { requires_lease: isRequired, resource } = entry?.safety ?? {}
  if (isRequired !== true) return null
  return typeof resource === 'string' ? resource : DEFAULT_RESOURCE
}

export function clearanceFor(entry: CatalogueEntry | null, standing: Standing): Clearance {
  if (standing.availability === 'unavailable') return OPEN
  if (standing.isStopped && isMotion(entry)) return blocked('safety.stopped')
  if (resourceOf(entry) === null) return OPEN
  return standing.epoch > 0 ? { epoch: standing.epoch, block: null } : blocked(codeOf(standing))
}

function isMotion(entry: CatalogueEntry | null): boolean {
  return resourceOf(entry) !== null || typeof entry?.safety?.timeout_s === 'number'
}

function codeOf({ me, lease }: Standing): string {
  if (me?.role === 'observer') return 'lease.forbidden'
  if (lease.request?.phase === 'queued') return 'lease.queued'
  return lease.state === 'other' ? 'lease.not_holder' : 'lease.required'
}

function blocked(code: string): Clearance {
  return { epoch: 0, block: { code } }
}
