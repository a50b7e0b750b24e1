import { useEffect, useState } from 'react'

/** Keeps the screen on while `isWanted`, where the browser can; whether it does. */
export function useAwake(isWanted: boolean): boolean {
  const [isAwake, setIsAwake] = useState(false)
  useEffect(() => {
    if (!isWanted) return
    let lock: WakeLockSentinel | null = null
    let isOver = false
    const ask = async () => {
      if (document.visibilityState !== 'visible' || !('wakeLock' in navigator)) return
      try {
        const got = await navigator.wakeLock.request('screen')
        if (isOver) return void got.release()
        lock = got
        setIsAwake(true)
        got.addEventListener('release', () => setIsAwake(false))
      } catch (error) {
        // A nearly empty battery is the usual reason; the page says that the screen goes off.
        if (!(error instanceof DOMException)) throw error
      }
    }
    // The system takes it away with every page that is hidden.
    const visible = () => void ask()
    document.addEventListener('visibilitychange', visible)
    void ask()
    return () => {
      isOver = true
      document.removeEventListener('visibilitychange', visible)
      void lock?.release()
    }
  }, [isWanted])
  return isWanted && isAwake
}
