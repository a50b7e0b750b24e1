import type { Catalogue } from '@mosaic/protocol'
import type { MediaLine } from './PeerLink'

/** Lines offered to a robot whose catalogue nobody knows: as many as the original dashboards do. */
const BLIND_LINES = 2

/** The media lines to offer: one per media connector in the catalogue's order; without one as many as are wanted. */
export function mediaLines(catalogue: Catalogue | null, wanted: number): MediaLine[] {
  const entries = catalogue?.entries.filter((entry) => entry.dataType === 'media')
  if (entries) return entries.map(({ label, kind }) => ({ label, kind: kind === 'audio' ? 'audio' : 'video' }))
  // Whose tracks come on these lines is the robot's choice; it names them by their streams.
  return Array.from({ length: Math.max(BLIND_LINES, wanted) }, () => ({ label: null, kind: 'video' }))
}
