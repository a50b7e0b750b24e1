import type { CatalogueEntry } from '@mosaic/client'
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

/** The schema id of what the robot sends. */
function arrivingId({ dataType, direction, schemaId, sentSchemaId }: CatalogueEntry): string | undefined {
  if (direction === 'to-robot') return undefined
  return dataType === 'json-bi' ? sentSchemaId : schemaId
}
