import type { CatalogueEntry } from '@mosaic/client'
import { useReadable } from '@mosaic/react'
import { IconAlertTriangle } from '@tabler/icons-react'
import type { AnyStore } from '../stores/storeKinds'
import classes from './delivery.module.css'
import { useDropping } from './useDelivery'

const TEXT = 'Messages are being dropped; the menu of this card has the details under “Delivery”.'

/** A warning beside the name of a connector while its messages are being dropped. */
export function DropMark({ robotId, entry, store }: { robotId: string; entry: CatalogueEntry; store: AnyStore }) {
  const isDropping = useDropping(robotId, entry, store)
  const { phase } = useReadable(store.state)
  if (!isDropping || phase !== 'open') return null
  return (
    <span className={classes.mark} role="img" aria-label={TEXT} title={TEXT} data-testid="drop-mark">
      <IconAlertTriangle size={14} stroke={2} aria-hidden />
    </span>
  )
}
