import type { Refusal } from '@mosaic/client'
import { useReadable } from '@mosaic/react'
import { useState } from 'react'
import { blockedText } from '../stores/blockedText'
import { isGuarded, refuses, sends, type AnyStore } from '../stores/storeKinds'
import { refusalText } from '../control/controlText'

interface Said {
  tone: 'ok' | 'bad'
  text: string
  /** The refusal that was last known when this was said: a newer one has the last word. */
  after: Refusal | null
}

/** A way to send messages to one connector, with what came of the last one. */
export interface Sender {
  /** Messages may leave the page now. */
  readonly canSend: boolean
  /** What is to be said: why nothing may be sent, what came of the last message, or nothing. */
  readonly said: Pick<Said, 'text'> & { readonly tone: Said['tone'] | undefined }
  /** Whether the link took it. */
  readonly send: (text: string) => boolean
  /** Say why nothing was sent. */
  readonly fail: (problem: string) => void
}

const NOTHING = { get: () => null, subscribe: () => () => {} }

/** Sends to a connector. `hint` is said while there is nothing else. */
export function useSender(store: AnyStore, hint = ''): Sender {
  const [said, setSaid] = useState<Said | null>(null)
  const refusal = useReadable(refuses(store) ? store.lastRefusal : NOTHING)
  const block = useReadable(isGuarded(store) ? store.sendBlocked : NOTHING)
  const { phase } = useReadable(store.state)
  const isAway = phase === 'reconnecting'
  const isOpen = phase === 'open' || isAway
  const shown = refusal !== null && refusal !== said?.after ? { tone: 'bad' as const, text: refusalText(refusal) } : said
  const text = isOpen && block !== null ? blockedText(block) : (shown?.text ?? (isOpen ? hint : 'Waiting for the robot'))
  return {
    canSend: isOpen && block === null,
    said: { tone: shown?.tone, text },
    send: (message) => {
      const isAccepted = sends(store) && store.sendData(message)
      setSaid({ tone: isAccepted ? 'ok' : 'bad', text: sentText(isAccepted, isAway), after: refusal })
      return isAccepted
    },
    fail: (problem) => setSaid({ tone: 'bad', text: problem, after: refusal }),
  }
}

function sentText(isAccepted: boolean, isAway: boolean): string {
  if (isAway) return isAccepted ? 'Goes out when the connection is back' : 'Not taken while the connection is away'
  return isAccepted ? 'Sent' : 'The link did not take it; try again'
}
