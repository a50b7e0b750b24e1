import type { CatalogueEntry } from '@mosaic/client'
import { useReadable, useRobotConnection } from '@mosaic/react'
import { useMemo } from 'react'

/** The connectors of the robot that send one of these messages, in the order of its YAML file. */
export function useEntries(robotId: string, schemaIds: readonly string[]): readonly CatalogueEntry[] {
  const catalogue = useReadable(useRobotConnection(robotId).catalogue)
  return useMemo(
    () => (catalogue?.entries ?? []).filter((entry) => entry.direction !== 'to-robot' && schemaIds.includes(entry.schemaId ?? '')),
    [catalogue, schemaIds],
  )
}
