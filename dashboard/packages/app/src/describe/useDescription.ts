import type { DescribedConnector, RobotSummary } from '@mosaic/client'
import { readConnectorConfig } from '@mosaic/client'
import { useMosaicClient } from '@mosaic/react'
import { useMemo, useState } from 'react'
import { type Failure, failureOf } from '@mosaic/widgets'
import { withConnectors, withoutLabel } from './description'

export interface Description {
  connectors: readonly DescribedConnector[]
  /** False: this account may only look. */
  mayDescribe: boolean
  isBusy: boolean
  failure: Failure | null
  /** True once it is kept. */
  add: (connectors: readonly DescribedConnector[]) => Promise<boolean>
  remove: (label: string) => Promise<boolean>
}

/** What people say that a robot has, kept on the server for everybody who sees it. */
export function useDescription(robot: RobotSummary): Description {
  const client = useMosaicClient()
  const [isBusy, setIsBusy] = useState(false)
  const [failure, setFailure] = useState<Failure | null>(null)
  const stored = robot.connectorConfigIsStored === false ? null : robot.connectorConfig
  const connectors = useMemo(() => readConnectorConfig(stored), [stored])
  const save = async (change: (before: readonly DescribedConnector[]) => DescribedConnector[]) => {
    setIsBusy(true)
    setFailure(null)
    try {
      // Somebody else may have added to it meanwhile.
      const now = await client.api.robot(robot.id)
      await client.describeRobot(robot.id, change(readConnectorConfig(now.connectorConfigIsStored === false ? null : now.connectorConfig)))
      return true
    } catch (error) {
      setFailure(failureOf(error))
      return false
    } finally {
      setIsBusy(false)
    }
  }
  return {
    connectors,
    mayDescribe: robot.myRole !== 'observer',
    isBusy,
    failure,
    add: (added) => save((before) => withConnectors(before, added)),
    remove: (label) => save((before) => withoutLabel(before, label)),
  }
}
