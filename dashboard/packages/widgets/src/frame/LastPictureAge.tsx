import { nowMs } from '@mosaic/client'
import { useEffect, useRef } from 'react'
import type { ShowsMedia } from '../stores/storeKinds'
import { lastPictureText } from './shownAge'

const PERIOD_MS = 250

/** How old the last picture is by now. Written past React; nobody wants to hear it four times a second. */
export function LastPictureAge({ store }: { store: ShowsMedia }) {
  const element = useRef<HTMLSpanElement>(null)
  useEffect(() => {
    const show = () => {
      const text = lastPictureText(store.latestPicture, nowMs())
      if (element.current !== null) element.current.textContent = text === '' ? '' : `· ${text}`
    }
    show()
    const timer = setInterval(show, PERIOD_MS)
    return () => clearInterval(timer)
  }, [store])
  return <span ref={element} aria-hidden data-testid="picture-age" />
}
