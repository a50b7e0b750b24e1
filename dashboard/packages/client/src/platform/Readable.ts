/** A value that changes and says so; it fits React's `useSyncExternalStore` as it is. */
export interface Readable<T> {
  /** The value now; the same reference until it changes. */
  readonly get: () => T
  /** Tell me when it changes; the result takes the listener away again. */
  readonly subscribe: (listener: () => void) => () => void
}

/** Holds a value that its owner sets and others read. A listener that throws is reported and disturbs nobody else. */
export class Value<T> implements Readable<T> {
  private readonly listeners = new Listeners<[]>()

  constructor(private value: T) {}

  readonly get = (): T => this.value

  readonly subscribe = (listener: () => void): (() => void) => this.listeners.add(listener)

  /** Change the value; listeners are told if it is another one. */
  set(value: T): void {
    if (Object.is(value, this.value)) return
    this.value = value
    this.listeners.tell()
  }

  /** How many listen. */
  get listenerCount(): number {
    return this.listeners.size
  }
}

/** Tells functions that want to be told; one may leave (or come) meanwhile. */
export class Listeners<A extends unknown[]> {
  // A wrapper per call of `add`: the same function may be added twice and counts twice.
  private readonly entries = new Set<{ listener: (...args: A) => unknown }>()

  add(listener: (...args: A) => unknown): () => void {
    const entry = { listener }
    this.entries.add(entry)
    return () => {
      this.entries.delete(entry)
    }
  }

  tell(...args: A): void {
    for (const entry of [...this.entries]) {
      if (this.entries.has(entry)) guarded(() => entry.listener(...args))
    }
  }

  get size(): number {
    return this.entries.size
  }
}

/** Run somebody else's function: what it throws, now or later, is reported on the console and goes no further. */
export function guarded(run: () => unknown): void {
  try {
    const result = run()
    if (result instanceof Promise) result.catch(report)
  } catch (error) {
    report(error)
  }
}

function report(error: unknown): void {
  console.error('mosaic: a listener failed', error)
}
