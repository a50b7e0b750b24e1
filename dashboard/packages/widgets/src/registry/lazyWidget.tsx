import { lazy, Suspense, type ComponentType } from 'react'
import type { WidgetProps } from './WidgetDefinition'

type Load = () => Promise<ComponentType<WidgetProps>>

/** A widget whose code comes when it is first shown. Until then its card is empty, and has its size already. */
export function lazyWidget(load: Load): ComponentType<WidgetProps> {
  let Loaded = lazyOnce()
  function lazyOnce() {
    return lazy(async () => {
      try {
        return { default: await load() }
      } catch (error) {
        Loaded = lazyOnce() // whoever presses "Try again" doesn't get the same answer
        throw new Error('Its code could not be fetched: the server may be away, or newer than this page; then reload it.', { cause: error })
      }
    })
  }
  return function LazyWidget(props: WidgetProps) {
    return (
      <Suspense fallback={<div aria-busy />}>
        <Loaded {...props} />
      </Suspense>
    )
  }
}
