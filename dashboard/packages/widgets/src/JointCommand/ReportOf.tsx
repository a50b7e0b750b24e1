import type { CatalogueEntry } from '@mosaic/client'
import { useEffect } from 'react'
import { jointsOf, type Joint } from '../Joints/joints'
import { jsonOf } from '../stores/decode'
import type { AnyStore } from '../stores/storeKinds'
import { useConnectorStore } from '../stores/useConnectorStore'
import { useLatest } from '../stores/useReceived'

export interface ReportOfProps {
  robotId: string
  report: CatalogueEntry
  onJoints: (label: string, joints: readonly Joint[]) => void
}

/** Hears where the joints of another connector stand, as often as people read; draws nothing. */
export function ReportOf({ robotId, report, onJoints }: ReportOfProps) {
  const store = useConnectorStore(robotId, report.label, report.dataType)
  return store === null ? null : <Listening store={store} label={report.label} onJoints={onJoints} />
}

function Listening({ store, label, onJoints }: { store: AnyStore; label: string; onJoints: ReportOfProps['onJoints'] }) {
  const latest = useLatest(store)
  useEffect(() => {
    const decoded = latest === null ? null : jsonOf(latest.data)
    onJoints(label, (decoded?.ok === true ? jointsOf(decoded.value) : null) ?? [])
  }, [latest, label, onJoints])
  return null
}
