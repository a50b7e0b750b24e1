/** Says a target again and again until it is reached: a robot that hears nothing holds still, so one message moves an
 *  arm no further than its time-out lasts. It ends by itself when the page is not looked at, when something else
 *  commands or a stop was said, when the connection is lost, and after a while. */
import { useEffect, useEffectEvent, useState } from 'react'
import type { CatalogueEntry } from '@mosaic/client'
import { isGuarded, refuses, sends, type AnyStore } from '../stores/storeKinds'

const LONGEST_PERIOD_S = 0.1
/** Two of three messages may be lost within one time-out. */
const PER_TIMEOUT = 3
/** Refused for their time alone, as a bad link does to some of many; the next one may pass. */
const PASSING_GATES: readonly string[] = ['age', 'sequence', 'rate', 'queue']

export interface TargetKeeping<T> {
  entry: CatalogueEntry
  store: AnyStore
  /** What is said `elapsedS` after the first message. */
  message: (target: T, elapsedS: number) => object
  isReached: (target: T) => boolean
  /** So long at most. */
  lastsS: (target: T) => number
}

export interface KeptTarget<T> {
  /** What is being said; null: nothing. */
  readonly target: T | null
  /** Call when its first message was sent. A robot that doesn't mind silence is told once. */
  readonly keep: (target: T) => void
  /** Fall silent: what moves holds within its time-out. */
  readonly end: () => void
}

export function useKeptTarget<T>({ entry, store, message, isReached, lastsS }: TargetKeeping<T>): KeptTarget<T> {
  const [kept, setKept] = useState<{ target: T; sinceMs: number; refusal: unknown } | null>(null)
  const periodS = repeatPeriodS(entry.safety)
  /** Whether it goes on. */
  const say = useEffectEvent((one: NonNullable<typeof kept>): boolean => {
    const elapsedS = (performance.now() - one.sinceMs) / 1000
    const isOver = isReached(one.target) || elapsedS > lastsS(one.target) || hasEnded(store, one.refusal)
    return !isOver && sends(store) && store.sendData(JSON.stringify(message(one.target, elapsedS)))
  })
  useEffect(() => {
    if (kept === null || periodS === null) return
    const leaving = new AbortController()
    const end = () => setKept(null)
    const timer = setInterval(() => say(kept) || end(), periodS * 1000)
    window.addEventListener('blur', end, { signal: leaving.signal })
    document.addEventListener('visibilitychange', end, { signal: leaving.signal })
    return () => {
      clearInterval(timer)
      leaving.abort()
    }
  }, [kept, periodS])
  return {
    target: kept?.target ?? null,
    keep: (target) => periodS !== null && setKept({ target, sinceMs: performance.now(), refusal: refusalOf(store) }),
    end: () => setKept(null),
  }
}

/** How often a target must be said; null: the robot doesn't mind silence. */
export function repeatPeriodS(safety: Record<string, unknown> | undefined): number | null {
  const timeoutS = safety?.['timeout_s']
  return typeof timeoutS === 'number' && timeoutS > 0 ? Math.min(LONGEST_PERIOD_S, timeoutS / PER_TIMEOUT) : null
}

function hasEnded(store: AnyStore, refusalBefore: unknown): boolean {
  if (store.state.get().phase !== 'open' || (isGuarded(store) && store.sendBlocked.get() !== null)) return true
  const refusal = refusalOf(store)
  return refusal !== null && refusal !== refusalBefore && !PASSING_GATES.includes(refusal.gate ?? '')
}

const refusalOf = (store: AnyStore) => (refuses(store) ? store.lastRefusal.get() : null)
