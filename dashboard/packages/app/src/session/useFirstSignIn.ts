import type { MosaicClient } from '@mosaic/client'
import { useMosaicClient } from '@mosaic/react'
import { useCallback, useEffect, useState } from 'react'
import type { AddressCode } from './addressCodes'
import { deviceName } from './deviceName'
import { type Failure, failureOf } from '@mosaic/widgets'

export interface FirstSignIn {
  isBusy: boolean
  failure: Failure | null
  /** There is a session already: whose it is, and the one-time code of somebody, which is not used before it is wanted. */
  asks: boolean
  /** Sign in with the code after all, or let it be. */
  answer: (takesCode: boolean) => void
}

type State = Omit<FirstSignIn, 'answer'>

/** Signs in with the session that this browser remembers, else with the code that the page was opened with. */
export function useFirstSignIn(code: AddressCode | null): FirstSignIn {
  const client = useMosaicClient()
  const [state, setState] = useState<State>({ isBusy: true, failure: null, asks: false })
  useEffect(() => {
    const signIn = startedSignIns.get(client) ?? signedIn(client, code)
    // A code is used up by its first exchange: React's second mount must find the same one under way.
    startedSignIns.set(client, signIn)
    let isMounted = true
    signIn
      .then((asks) => ({ isBusy: false, failure: null, asks }))
      .catch((error: unknown) => ({ isBusy: false, failure: code === null ? null : failureOf(error), asks: false }))
      .then((result) => isMounted && setState(result))
      .catch(() => {})
    return () => {
      isMounted = false
    }
  }, [client, code])

  const answer = useCallback(
    (takesCode: boolean) => {
      if (!takesCode || code === null) {
        setState({ isBusy: true, failure: null, asks: false })
        void kept(client).then(() => setState({ isBusy: false, failure: null, asks: false }))
        return
      }
      setState({ isBusy: true, failure: null, asks: true })
      client
        .loginWithCode(code.value)
        .then(() => setState({ isBusy: false, failure: null, asks: false }))
        .catch((error: unknown) => setState({ isBusy: false, failure: failureOf(error), asks: true }))
    },
    [client, code],
  )
  return { ...state, answer }
}

/** Whoever stays signed in is, once the server can be asked; it may have been away when the page began. */
async function kept(client: MosaicClient): Promise<void> {
  if (client.session.get() === null) await client.restore()
}

/** True: somebody is signed in, whom a one-time code would replace. Links come from others, too. */
async function signedIn(client: MosaicClient, code: AddressCode | null): Promise<boolean> {
  await client.restore()
  if (code === null) return false
  // Also a session that could not be checked, because the server was away, is somebody's.
  // Who is paired already and scans again needs no second place among the robot's devices.
  if (client.remembersSession) return code.kind === 'code'
  if (code.kind === 'code') await client.loginWithCode(code.value)
  else await client.pair({ code: code.value }, deviceName(navigator.userAgent))
  return false
}

const startedSignIns = new WeakMap<object, Promise<boolean>>()
