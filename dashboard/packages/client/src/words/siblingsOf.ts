import type { Catalogue, CatalogueEntry } from '@mosaic/protocol'

/** The other entries of the same connector, whatever the robot's file calls it; none where it has one handler. Pure. */
export function siblingsOf(catalogue: Pick<Catalogue, 'entries'> | null, { label, connector }: CatalogueEntry): readonly CatalogueEntry[] {
  if (connector === undefined) return []
  return (catalogue?.entries ?? []).filter((other) => other.connector === connector && other.label !== label)
}
