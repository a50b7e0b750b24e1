import type { Catalogue, CatalogueEntry } from '@mosaic/protocol'

/** The entry of this label; null where nobody told one. Pure. */
export function entryFor(catalogue: Pick<Catalogue, 'entries'> | null, label: string): CatalogueEntry | null {
  return catalogue?.entries.find((entry) => entry.label === label) ?? null
}
