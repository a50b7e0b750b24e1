import { useMosaicClient } from '@mosaic/react'
import { useEffect, useState } from 'react'
import { failureOf, type Failure } from './errorText'

export interface CodeSignIn {
  isBusy: boolean
  failure: Failure | null
}

/** Signs in with the code that the page was opened with, else with the session that this browser remembers. */
export function useOneTimeCode(code: string | null): CodeSignIn {
  const client = useMosaicClient()
  const [state, setState] = useState<CodeSignIn>({ isBusy: true, failure: null })
  useEffect(() => {
    const signIn = startedSignIns.get(client) ?? (code === null ? client.restore() : client.loginWithCode(code))
    // A code is used up by its first exchange: React's second mount must find the same one under way.
    startedSignIns.set(client, signIn)
    let isMounted = true
    signIn
      .then(() => ({ isBusy: false, failure: null }))
      .catch((error: unknown) => ({ isBusy: false, failure: code === null ? null : failureOf(error) }))
      .then((result) => isMounted && setState(result))
      .catch(() => {})
    return () => {
      isMounted = false
    }
  }, [client, code])
  return state
}

const startedSignIns = new WeakMap<object, Promise<void>>()
