/** Whether a message of this page may leave for a connector, and under which epoch. Pure. */
import type { CatalogueEntry } from '@mosaic/protocol'
import type { Availability, LeaseView, PeerView, SendBlock } from '../words/views'

/**
 * `epoch` goes into the frame; with a `block` the robot would do nothing. What a stop blocks leaves all the same: the
 * robot must see that a program sends on, to let nothing of it act after the clear before the program has let go.
 */
export interface Clearance {
  epoch: number
  block: SendBlock | null
  leaves: boolean
}

export interface Standing {
  availability: Availability
  isStopped: boolean
  me: PeerView | null
  /** Of the connector's resource. */
  lease: LeaseView
  epoch: number
}

const OPEN: Clearance = { epoch: 0, block: null, leaves: true }
const DEFAULT_RESOURCE = 'motion'

/** The resource whose lease commands for this connector need; null: they need none. */
export function resourceOf(entry: CatalogueEntry | null): string | null {
  const { requires_lease: isRequired, resource } = entry?.safety ?? {}
  if (isRequired !== true) return null
  return typeof resource === 'string' ? resource : DEFAULT_RESOURCE
}

export function clearanceFor(entry: CatalogueEntry | null, standing: Standing): Clearance {
  if (standing.availability === 'unavailable') return OPEN
  const isFree = resourceOf(entry) === null
  const block = standing.isStopped && isMotion(entry) ? { code: 'safety.stopped' } : null
  if (isFree || standing.epoch > 0) return { epoch: isFree ? 0 : standing.epoch, block, leaves: true }
  return { epoch: 0, block: block ?? blockOf(standing, resourceOf(entry)), leaves: false }
}

function isMotion(entry: CatalogueEntry | null): boolean {
  return resourceOf(entry) !== null || typeof entry?.safety?.timeout_s === 'number'
}

/** A resource of a name of its own has a button of its own, beside that of the whole robot. */
function blockOf(standing: Standing, resource: string | null): SendBlock {
  const code = codeOf(standing)
  return code === 'lease.required' && resource !== DEFAULT_RESOURCE ? { code, message: `Take control of ${resource}.` } : { code }
}

function codeOf({ me, lease }: Standing): string {
  if (me?.role === 'observer') return 'lease.forbidden'
  if (lease.request?.phase === 'queued') return 'lease.queued'
  return lease.state === 'other' ? 'lease.not_holder' : 'lease.required'
}
