import { siblingsOf, type CatalogueEntry } from '@mosaic/client'
import { useReadable, useRobotConnection } from '@mosaic/react'
import { useMemo } from 'react'

/** The connectors of the robot that send one of these messages, in the order of its YAML file. */
export function useEntries(robotId: string, schemaIds: readonly string[]): readonly CatalogueEntry[] {
  const catalogue = useReadable(useRobotConnection(robotId).catalogue)
  return useMemo(
    () => (catalogue?.entries ?? []).filter((entry) => schemaIds.includes(arrivingId(entry) ?? '')),
    [catalogue, schemaIds],
  )
}

/** The other entries of the widget's own connector, whatever the robot's file calls it. */
export function useSiblings(robotId: string, entry: CatalogueEntry): readonly CatalogueEntry[] {
  const catalogue = useReadable(useRobotConnection(robotId).catalogue)
  return useMemo(() => siblingsOf(catalogue, entry), [catalogue, entry])
}

/** The schema id of what the robot sends. */
export function arrivingId({ dataType, direction, schemaId, sentSchemaId }: CatalogueEntry): string | undefined {
  if (direction === 'to-robot') return undefined
  return dataType === 'json-bi' ? sentSchemaId : schemaId
}
