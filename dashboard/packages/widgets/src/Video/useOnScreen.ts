import { useEffect, useState, type RefObject } from 'react'

/** Whether the element is on the screen, and not behind another that fills it. A browser that can't tell says yes. */
export function useOnScreen(element: RefObject<Element | null>): boolean {
  const [isOnScreen, setIsOnScreen] = useState(true)
  const [isBehind, setIsBehind] = useState(false)
  useEffect(() => {
    if (element.current === null || typeof IntersectionObserver === 'undefined') return undefined
    const observer = new IntersectionObserver((entries) => setIsOnScreen(entries.at(-1)?.isIntersecting !== false))
    observer.observe(element.current)
    return () => observer.disconnect()
  }, [element])
  useEffect(() => {
    const look = () => setIsBehind(isBehindAnother(element.current))
    document.addEventListener('fullscreenchange', look)
    return () => document.removeEventListener('fullscreenchange', look)
  }, [element])
  return isOnScreen && !isBehind
}

function isBehindAnother(element: Element | null): boolean {
  const full = document.fullscreenElement
  return element !== null && full?.contains(element) === false && !element.contains(full)
}
