import { useEffect, useState, type RefObject } from 'react'

/** Pictures just outside are kept: they are a flick of the wheel away. */
const MARGIN = '120px'

/** Whether the element is on the screen, or nearly. A browser that can't tell says yes. */
export function useOnScreen(element: RefObject<Element | null>): boolean {
  const [isOnScreen, setIsOnScreen] = useState(true)
  useEffect(() => {
    if (element.current === null || typeof IntersectionObserver === 'undefined') return undefined
    const observer = new IntersectionObserver((entries) => setIsOnScreen(entries.at(-1)?.isIntersecting !== false), {
      rootMargin: MARGIN,
    })
    observer.observe(element.current)
    return () => observer.disconnect()
  }, [element])
  return isOnScreen
}
