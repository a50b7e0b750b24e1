import { answerPatienceMs, BidirectionalStore, MosaicError, RequestCaller, type RequestOptions } from '@mosaic/client'
import { useCallback, useEffect, useRef, useState } from 'react'
import { useMosaicStore } from './useMosaicStore'
import { useRobotConnection } from './useRobotConnection'

/** How the newest request of a component stands. */
export interface RequestView<A> {
  /** `idle`: nothing was asked yet. */
  readonly phase: 'idle' | 'asking' | 'answered' | 'failed'
  /** What the connector told last before its answer; null before it told anything. */
  readonly progress: unknown
  /** The answer; null before there is one. */
  readonly answer: A | null
  /** Why there is none. */
  readonly error: MosaicError | null
}

/** Requests to one connector of a robot. */
export interface Requests<Q, A> extends RequestView<A> {
  /**
   * Ask; several may be asked at once. The promise has the answer, or is rejected with a `MosaicError`; whoever only shows
   * `answer` and `error` need not look at it.
   */
  readonly ask: (question: Q, options?: RequestOptions) => Promise<A>
  /** Take the newest request back. */
  readonly cancel: () => void
}

const IDLE = { phase: 'idle', progress: null, answer: null, error: null } as const

/**
 * Ask a connector that answers requests. `ask` and `cancel` are stable; what still waits when the component goes is taken
 * back.
 */
export function useRequest<Q = unknown, A = unknown>(robotId: string, label: string): Requests<Q, A> {
  const stores = useMosaicStore()
  const { catalogue } = useRobotConnection(robotId)
  const caller = useRef<RequestCaller | null>(null)
  const refusal = useRef(new MosaicError('request.not_sent'))
  const newest = useRef<AbortController | null>(null)
  const [view, setView] = useState<RequestView<A>>(IDLE)

  useEffect(() => {
    const connector = { robotId, connectorId: label, dataType: 'json-bi' } as const
    let own: RequestCaller
    try {
      own = new RequestCaller(stores.getOrCreateStore(connector, BidirectionalStore))
    } catch (error) {
      if (!(error instanceof TypeError)) throw error
      refusal.current = new MosaicError('channel.wrong_direction', `'${label}' answers no requests: it is shown here as something else.`)
      return undefined
    }
    caller.current = own
    return () => {
      own.close()
      caller.current = null
      stores.releaseStore(connector)
    }
  }, [robotId, label, stores])

  const ask = useCallback((question: Q, options: RequestOptions = {}): Promise<A> => {
    const own = new AbortController()
    newest.current = own
    const show = (change: Partial<RequestView<A>>) => {
      if (newest.current === own) setView((before) => ({ ...before, ...change }))
    }
    show({ ...IDLE, phase: 'asking' })
    if (options.signal?.aborted === true) own.abort()
    options.signal?.addEventListener('abort', () => own.abort(), { once: true })
    const onProgress = (progress: unknown) => {
      show({ progress })
      options.onProgress?.(progress)
    }
    const { timeoutMs = answerPatienceMs(catalogue.get(), label) } = options
    const asked = caller.current?.request(question, { timeoutMs, onProgress, signal: own.signal }) as Promise<A> | undefined
    const answer = asked ?? Promise.reject(refusal.current)
    answer.then(
      (value) => show({ phase: 'answered', answer: value }),
      (error: unknown) => show({ phase: 'failed', error: error instanceof MosaicError ? error : new MosaicError('request.failed') }),
    )
    return answer
  }, [catalogue, label])
  const cancel = useCallback(() => newest.current?.abort(), [])
  return { ...view, ask, cancel }
}
