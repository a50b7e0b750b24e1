import { connectorsInTabs, type DescribedConnector, type TabConnector } from '@mosaic/client'
import { useMosaicClient, useReadable, useRobotConnection } from '@mosaic/react'
import { useEffect, useState } from 'react'
import { describedRows, labelOf } from './description'

export interface Found {
  connectors: readonly DescribedConnector[]
  label: string
  /** Who says so. */
  source: string
}

/** Connectors that nobody described, but that show: pictures that arrive, and what tabs of original dashboards name. */
export function useFound(robotId: string, described: readonly DescribedConnector[]): readonly Found[] {
  const pictures = useReadable(useRobotConnection(robotId).arrivedPictures)
  const inTabs = useTabs(robotId)
  const known = new Set(described.map(labelOf))
  const found = [
    ...pictures.map((label) => ({ label, connectors: [{ connectorId: label, connectorType: '', dataType: 'media' as const }], source: 'the robot sends this picture' })),
    ...describedRows(inTabs.map(({ connector }) => connector)).map(({ label }) => ({
      label,
      // Both halves of a check of the connection.
      connectors: inTabs.filter(({ connector }) => labelOf(connector) === label).map(({ connector }) => connector),
      source: `the tab ‘${inTabs.find(({ connector }) => labelOf(connector) === label)?.tab ?? ''}’ names it`,
    })),
  ]
  return found.filter(({ label }, index) => !known.has(label) && found.findIndex((one) => one.label === label) === index)
}

function useTabs(robotId: string): readonly TabConnector[] {
  const { api } = useMosaicClient()
  const [found, setFound] = useState<readonly TabConnector[]>([])
  useEffect(() => {
    let isCurrent = true
    const read = async () => {
      const tabs = await Promise.all((await api.dashboardTabs()).map(({ id }) => api.dashboardTab(id)))
      if (isCurrent) setFound(connectorsInTabs(tabs, robotId))
    }
    // A server without tabs has nothing to tell.
    read().catch(() => {})
    return () => {
      isCurrent = false
    }
  }, [api, robotId])
  return found
}
