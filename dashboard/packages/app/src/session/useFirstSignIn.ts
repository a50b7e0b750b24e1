import type { MosaicClient } from '@mosaic/client'
import { useMosaicClient } from '@mosaic/react'
import { useEffect, useState } from 'react'
import type { AddressCode } from './addressCodes'
import { deviceName } from './deviceName'
import { failureOf, type Failure } from './errorText'

export interface FirstSignIn {
  isBusy: boolean
  failure: Failure | null
}

/** Signs in with the code that the page was opened with, else with the session that this browser remembers. */
export function useFirstSignIn(code: AddressCode | null): FirstSignIn {
  const client = useMosaicClient()
  const [state, setState] = useState<FirstSignIn>({ isBusy: true, failure: null })
  useEffect(() => {
    const signIn = startedSignIns.get(client) ?? signedIn(client, code)
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

async function signedIn(client: MosaicClient, code: AddressCode | null): Promise<void> {
  if (code?.kind === 'code') return client.loginWithCode(code.value)
  await client.restore()
  // Who is paired already and scans again needs no second place among the robot's devices.
  if (code !== null && client.session.get() === null) {
    await client.pair({ code: code.value }, deviceName(navigator.userAgent))
  }
}

const startedSignIns = new WeakMap<object, Promise<void>>()
