import type { CatalogueEntry, DeliveryRow } from '@mosaic/client'
import { useReadable, useRobotConnection } from '@mosaic/react'
import { useEffect, useMemo, useState, useSyncExternalStore } from 'react'
import type { AnyStore } from '../stores/storeKinds'
import { DropWatch } from './DropWatch'

const PERIOD_MS = 1000

/** What the robot says of a connector, once a second while the component is shown; undefined: nothing. */
export function useDeliveryRow(robotId: string, label: string): DeliveryRow | undefined {
  const { delivery } = useRobotConnection(robotId)
  useEffect(() => delivery.watch(), [delivery])
  return useReadable(delivery.rows)[label]
}

/** The code why a connector fails now; undefined: it does not, or the robot tells nothing. Renders again only when that changes. */
export function useFailureCode(robotId: string, label: string): string | undefined {
  const { delivery } = useRobotConnection(robotId)
  useEffect(() => delivery.watch(), [delivery])
  return useSyncExternalStore(delivery.rows.subscribe, () => delivery.rows.get()[label]?.failureCode)
}

/** Whether messages of this connector are being dropped now. Renders again only when that changes. */
export function useDropping(robotId: string, entry: CatalogueEntry, store: AnyStore): boolean {
  const { delivery } = useRobotConnection(robotId)
  const { label } = entry
  const watch = useMemo(() => new DropWatch(entry.delivery), [entry.delivery])
  const [isDropping, setDropping] = useState(false)
  useEffect(() => {
    const end = delivery.watch()
    const timer = setInterval(() => setDropping(watch.sample(store.counters, delivery.rows.get()[label])), PERIOD_MS)
    return () => {
      clearInterval(timer)
      end()
    }
  }, [delivery, watch, store, label])
  return isDropping
}

export interface LocalRates {
  rateHz: number
  bytesPerS: number
}

export interface LocalDelivery {
  received: LocalRates
  sent: LocalRates
}

const IDLE: LocalRates = { rateHz: 0, bytesPerS: 0 }

/** What arrives and leaves here per second, from the store's counters. */
export function useLocalDelivery(store: AnyStore): LocalDelivery {
  const [rates, setRates] = useState<LocalDelivery>({ received: IDLE, sent: IDLE })
  useEffect(() => {
    let before = totalsOf(store)
    let beforeMs = performance.now()
    const timer = setInterval(() => {
      const now = totalsOf(store)
      const nowMs = performance.now()
      const seconds = Math.max(0.001, (nowMs - beforeMs) / 1000)
      setRates({
        received: { rateHz: (now.received - before.received) / seconds, bytesPerS: (now.receivedBytes - before.receivedBytes) / seconds },
        sent: { rateHz: (now.sent - before.sent) / seconds, bytesPerS: (now.sentBytes - before.sentBytes) / seconds },
      })
      before = now
      beforeMs = nowMs
    }, PERIOD_MS)
    return () => clearInterval(timer)
  }, [store])
  return rates
}

function totalsOf({ counters: { received, receivedBytes, sent, sentBytes } }: AnyStore) {
  return { received, receivedBytes, sent, sentBytes }
}
