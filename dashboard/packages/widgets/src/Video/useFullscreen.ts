import { useEffect, useState, type RefObject } from 'react'

/** Whether the element fills the whole screen. */
export function useFullscreen(element: RefObject<Element | null>): boolean {
  const [isFullscreen, setIsFullscreen] = useState(false)
  useEffect(() => {
    const changed = () => setIsFullscreen(document.fullscreenElement !== null && document.fullscreenElement === element.current)
    document.addEventListener('fullscreenchange', changed)
    return () => document.removeEventListener('fullscreenchange', changed)
  }, [element])
  return isFullscreen
}
