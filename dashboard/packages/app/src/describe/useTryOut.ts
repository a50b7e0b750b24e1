import { guessOf, ReceivableStore, type Guess } from '@mosaic/client'
import { useMosaicStore, useReadable, useRobotConnection } from '@mosaic/react'
import { useEffect, useState } from 'react'

/** A connector that sends at all has sent by then; the slowest of the known ones sends once a second. */
export const PATIENCE_MS = 6000
/** More of them say nothing more. */
const ENOUGH = 5

export interface TryOut {
  phase: 'waiting' | 'heard' | 'silent'
  guess: Guess | null
  /** It came on the first numbered channel, `<label>-0`. */
  isNumbered: boolean
}

/** Opens a label for as long as it is mounted, and listens. It sends nothing: what receives could be a drive. */
export function useTryOut(robotId: string, label: string): TryOut {
  const stores = useMosaicStore()
  const isPicture = useReadable(useRobotConnection(robotId).arrivedPictures).includes(label)
  const [heard, setHeard] = useState<TryOut>({ phase: 'waiting', guess: null, isNumbered: false })
  useEffect(() => {
    if (isPicture) return undefined
    const listen = (connectorId: string, isNumbered: boolean) => {
      const connector = { robotId, connectorId, dataType: 'json-bi' } as const
      const store = stores.getOrCreateStore(connector)
      const messages: ArrayBuffer[] = []
      const hear = (data: ArrayBuffer) => {
        if (messages.push(data) <= ENOUGH) setHeard({ phase: 'heard', guess: guessOf(messages), isNumbered })
      }
      const unsubscribe = store instanceof ReceivableStore ? store.subscribe(hear) : () => {}
      return () => {
        unsubscribe()
        stores.releaseStore(connector)
      }
    }
    const ends = [listen(label, false), listen(`${label}-0`, true)]
    const timer = setTimeout(() => setHeard((now) => (now.phase === 'waiting' ? { ...now, phase: 'silent' } : now)), PATIENCE_MS)
    return () => {
      clearTimeout(timer)
      for (const end of ends) end()
    }
  }, [robotId, label, isPicture, stores])
  return isPicture ? { phase: 'heard', guess: guessOf([], true), isNumbered: false } : heard
}
