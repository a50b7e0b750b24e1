import { useEffect, useEffectEvent } from 'react'
import { escapePressed, type LastEscape } from './stopKey'

/** Calls `stop` for the stop key, wherever the focus is: in a field, a dialog or nowhere. */
export function useStopKey(stop: () => void, isOn = true): void {
  const onStop = useEffectEvent(stop)
  useEffect(() => {
    if (!isOn) return undefined
    let last: LastEscape = null
    const listen = (event: KeyboardEvent) => {
      if (event.code !== 'Escape') return
      const result = escapePressed(last, { isRepeat: event.repeat, atMs: event.timeStamp })
      last = result.last
      if (result.stops) onStop()
    }
    // Before anybody else: a dialog that keeps Escape to itself must not keep the stop.
    window.addEventListener('keydown', listen, { capture: true })
    return () => window.removeEventListener('keydown', listen, { capture: true })
  }, [isOn])
}
