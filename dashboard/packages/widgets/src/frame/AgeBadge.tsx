import { nowMs } from '@mosaic/client'
import { useEffect, useRef } from 'react'
import { ageOf, exactAge, formattedAge } from '../stores/age'
import { receives, type AnyStore } from '../stores/storeKinds'
import classes from './frame.module.css'

const PERIOD_MS = 250
/** From here on a value is no longer what the robot says now. */
const OLD_AFTER_MS = 3000

/** How old the store's last value is, whether it is a repeated one, and whether its connection is away. Written past React, four times a second. */
export function AgeBadge({ store }: { store: AnyStore }) {
  const element = useRef<HTMLSpanElement>(null)
  useEffect(() => {
    const show = () => {
      if (element.current !== null && receives(store)) write(element.current, store)
    }
    show()
    const timer = setInterval(show, PERIOD_MS)
    return () => clearInterval(timer)
  }, [store])
  return <span ref={element} className={classes.age} data-testid="age" />
}

function write(element: HTMLSpanElement, store: AnyStore): void {
  if (!receives(store)) return
  const { latest } = store
  const ageMs = latest === null ? null : ageOf(latest.info, nowMs())
  const text = ageMs === null ? 'no value yet' : formattedAge(ageMs)
  if (store.state.get().phase === 'reconnecting') {
    element.textContent = ageMs === null ? 'reconnecting' : `reconnecting · ${exactAge(ageMs)} old`
    element.dataset.state = 'away'
    return
  }
  element.textContent = latest?.info.latched === true ? `latched · ${text}` : text
  element.dataset.state = ageMs === null ? 'none' : ageMs > OLD_AFTER_MS ? 'old' : 'live'
}
