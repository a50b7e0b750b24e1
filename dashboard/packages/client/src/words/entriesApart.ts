/** The connectors of a robot as operators see them: one whose channels stand for themselves is as many as it has. Pure. */
import type { Catalogue, CatalogueEntry, ChannelEntry } from '@mosaic/protocol'

const KNOWN = new WeakMap<CatalogueEntry, readonly CatalogueEntry[]>()

/** Every connector, and of one whose channels stand for themselves each channel. The same entries for the same catalogue. */
export function entriesApart({ entries }: Pick<Catalogue, 'entries'>): readonly CatalogueEntry[] {
  return entries.flatMap(apart)
}

/** What has this label: a channel that stands for itself, else a whole connector. */
export function entryFor(catalogue: Pick<Catalogue, 'entries'>, label: string): CatalogueEntry | undefined {
  const withLabel = (entry: CatalogueEntry): boolean => entry.label === label
  return entriesApart(catalogue).find(withLabel) ?? catalogue.entries.find(withLabel)
}

function apart(entry: CatalogueEntry): readonly CatalogueEntry[] {
  const known = KNOWN.get(entry)
  if (known !== undefined) return known
  const alone = entry.channels.filter((channel) => channel.delivery !== undefined).map((channel) => standing(entry, channel))
  const found = alone.length > 0 ? alone : [entry]
  KNOWN.set(entry, found)
  return found
}

/** A channel as if it were a connector. */
function standing(entry: CatalogueEntry, { label, dataType, delivery, ...said }: ChannelEntry): CatalogueEntry {
  const direction = dataType === 'json-bi' ? 'both' : dataType.endsWith('u2r') ? 'to-robot' : 'to-operator'
  const channels = [{ label, dataType }]
  return { ...said, label, type: entry.type, kind: 'data', dataType, direction, channels, delivery: delivery ?? entry.delivery }
}
