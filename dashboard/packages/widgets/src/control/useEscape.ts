import { useEffect, useEffectEvent } from 'react'

/** Calls `close` for Escape wherever the focus is, as dialogs do; the key keeps what else it means, above all the stop. */
export function useEscape(close: () => void, isOn: boolean): void {
  const onEscape = useEffectEvent(close)
  useEffect(() => {
    if (!isOn) return undefined
    const listen = (event: KeyboardEvent) => {
      if (event.code === 'Escape' && !event.isComposing) onEscape()
    }
    window.addEventListener('keydown', listen, { capture: true })
    return () => window.removeEventListener('keydown', listen, { capture: true })
  }, [isOn])
}
