import { lazy, Suspense, type ComponentType, type ReactNode } from 'react'

/** A component whose code comes when it is first shown; what could not be fetched is fetched again when it is shown anew. */
export function fetched<P extends object>(load: () => Promise<ComponentType<P>>, meanwhile: ReactNode = null): ComponentType<P> {
  let Loaded = lazyOnce()
  function lazyOnce() {
    return lazy(async () => {
      try {
        return { default: await load() }
      } catch (error) {
        Loaded = lazyOnce() // whoever tries again doesn't get the same answer
        throw new Error('Its code could not be fetched: the server may be away, or newer than this page; then reload it.', { cause: error })
      }
    })
  }
  return function Fetched(props: P) {
    return (
      <Suspense fallback={meanwhile}>
        <Loaded {...props} />
      </Suspense>
    )
  }
}
