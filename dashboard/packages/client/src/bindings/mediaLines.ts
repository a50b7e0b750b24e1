import type { Catalogue, CatalogueEntry } from '@mosaic/protocol'
import type { MediaLine } from '../peers/PeerLink'

/** Lines offered to a robot that may be an original one: as many as the original dashboards do. */
const BLIND_LINES = 2

/**
 * The media lines to offer: one per media connector in the catalogue's order, sound after pictures. Without a catalogue,
 * or with one that people described, as many as are wanted.
 */
export function mediaLines(catalogue: Catalogue | null, wanted: number, isDescribed = false): MediaLine[] {
  const entries = catalogue?.entries.filter((entry) => entry.dataType === 'media')
  if (entries && !isDescribed) {
    const pictures = entries.filter(({ kind }) => kind !== 'audio')
    const sound = entries.filter(({ kind }) => kind === 'audio')
    return [...pictures.map(({ label }) => ({ label, kind: 'video' as const })), ...sound.map(soundLine)]
  }
  // Whose tracks come on these lines is the robot's choice; it names them by their streams.
  return Array.from({ length: Math.max(BLIND_LINES, wanted, entries?.length ?? 0) }, () => ({ label: null, kind: 'video' }))
}

function soundLine({ label, direction }: CatalogueEntry): MediaLine {
  return direction === 'to-robot' ? { label, kind: 'audio', isTalk: true } : { label, kind: 'audio' }
}
