import { useEffect, useRef } from 'react'
import classes from './Video.module.css'

/** A picture of before, in gray. */
export function KeptCanvas({ label, canvas }: { label: string; canvas: HTMLCanvasElement }) {
  const place = useRef<HTMLDivElement>(null)
  useEffect(() => place.current?.replaceChildren(canvas), [canvas])
  return <div ref={place} className={classes.kept} role="img" aria-label={`Last picture of ${label}`} data-testid="kept-picture" />
}
