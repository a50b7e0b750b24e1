/** Ways to follow a store's messages: at their own rate outside React, or slowed down for rendering. */
import type { MessageInfo } from '@mosaic/client'
import { useEffect, useEffectEvent, useState } from 'react'
import { jsonOf } from './decode'
import { receives, type AnyStore, type ReceivedMessage } from './storeKinds'

/** Calls `listener` for every message; rendering is not involved. */
export function useEveryMessage(store: AnyStore, listener: (data: ArrayBuffer, info?: MessageInfo) => void): void {
  const onMessage = useEffectEvent(listener)
  useEffect(() => (receives(store) ? store.subscribe((data, info) => onMessage(data, info)) : undefined), [store])
}

/** Calls `listener` with every message that is JSON. */
export function useEveryJson(store: AnyStore, listener: (value: unknown, info?: MessageInfo) => void): void {
  useEveryMessage(store, (data, info) => {
    const decoded = jsonOf(data)
    if (decoded.ok) listener(decoded.value, info)
  })
}

/** The last message, rendered at most every `periodMs`: people read no faster. */
export function useLatest(store: AnyStore, periodMs = 150): ReceivedMessage | null {
  const [shown, setShown] = useState<ReceivedMessage | null>(null)
  useEffect(() => {
    if (!receives(store)) return undefined
    const show = throttled(() => setShown(store.latest), periodMs)
    const unsubscribe = store.subscribe(show.call)
    return () => {
      unsubscribe()
      show.cancel()
    }
  }, [store, periodMs])
  return shown
}

/** The last message as JSON, rendered as by `useLatest`; null before the first one, and where it is no JSON. */
export function useLatestJson(store: AnyStore, periodMs?: number): unknown {
  const latest = useLatest(store, periodMs)
  const decoded = latest === null ? null : jsonOf(latest.data)
  return decoded?.ok === true ? decoded.value : null
}

/** Runs `action` at once, then at most every `periodMs`, and always after the last call. */
export function throttled(action: () => void, periodMs: number): { call: () => void; cancel: () => void } {
  let timer: ReturnType<typeof setTimeout> | undefined
  let isPending = false
  const run = () => {
    action()
    timer = setTimeout(() => {
      timer = undefined
      if (isPending) {
        isPending = false
        run()
      }
    }, periodMs)
  }
  return {
    call: () => {
      if (timer === undefined) run()
      else isPending = true
    },
    cancel: () => clearTimeout(timer),
  }
}
