import { nowMs } from '@mosaic/client'
import { useEffect, useRef } from 'react'
import { receives, type AnyStore } from '../stores/storeKinds'
import classes from './frame.module.css'
import { shownAge } from './shownAge'

const PERIOD_MS = 250

/** How old the store's last value is, whether it is a repeated one, and whether its connection is away. Written past React, four times a second. */
export function AgeBadge({ store, isFailing }: { store: AnyStore; isFailing: boolean }) {
  const element = useRef<HTMLSpanElement>(null)
  useEffect(() => {
    const show = () => {
      if (element.current !== null && receives(store)) write(element.current, store, isFailing)
    }
    show()
    const timer = setInterval(show, PERIOD_MS)
    return () => clearInterval(timer)
  }, [store, isFailing])
  return <span ref={element} className={classes.age} data-testid="age" />
}

function write(element: HTMLSpanElement, store: AnyStore, isFailing: boolean): void {
  if (!receives(store)) return
  const isAway = store.state.get().phase === 'reconnecting'
  const { text, state } = shownAge(store.latest?.info ?? null, isAway, nowMs(), isFailing)
  element.textContent = text
  element.dataset.state = state
}
