import { Button } from '@mantine/core'
import { reasonOf, type Refusal, type SendBlock } from '@mosaic/client'
import { useReadable } from '@mosaic/react'
import { IconSend } from '@tabler/icons-react'
import { useState } from 'react'
import { refusalText } from '../control/controlText'
import { MessageEditor } from '../form/MessageEditor'
import { useMessageDraft } from '../form/useMessageDraft'
import type { WidgetProps } from '../registry/WidgetDefinition'
import { prettyJson } from '../RawJson/prettyJson'
import { isGuarded, refuses, sends, type AnyStore } from '../stores/storeKinds'
import { useLatest } from '../stores/useReceived'
import classes from './JsonSender.module.css'

interface Said {
  tone: 'ok' | 'bad'
  text: string
  /** The refusal that was last known when this was said: a newer one has the last word. */
  after: Refusal | null
}

const NOTHING = { get: () => null, subscribe: () => () => {} }

/** Sends what is entered: a form of its schema or JSON, or plain text where the connector takes text. */
export function JsonSender({ entry, store }: WidgetProps) {
  const draft = useMessageDraft(entry.messageSchema, entry.dataType !== 'string-u2r')
  const [said, setSaid] = useState<Said | null>(null)
  const refusal = useReadable(refuses(store) ? store.lastRefusal : NOTHING)
  const block = useReadable(isGuarded(store) ? store.sendBlocked : NOTHING)
  const { phase } = useReadable(store.state)
  const isAway = phase === 'reconnecting'
  const isOpen = phase === 'open' || isAway

  const send = () => {
    const { checked } = draft
    if (!checked.ok) {
      setSaid({ tone: 'bad', text: checked.problem, after: refusal })
      return
    }
    const isAccepted = sends(store) && store.sendData(checked.text)
    setSaid({ tone: isAccepted ? 'ok' : 'bad', text: sentText(isAccepted, isAway), after: refusal })
  }

  const shown = refusal !== null && refusal !== said?.after ? refusedText(refusal) : said
  return (
    <div className={classes.root}>
      <MessageEditor name={`Message to ${entry.label}`} draft={draft} onSend={send} />
      <div className={classes.foot}>
        <span className={classes.said} role="status" data-tone={shown?.tone}>
          {isOpen && block !== null ? blockedText(block) : (shown?.text ?? (isOpen ? 'Ctrl+Enter sends' : 'Waiting for the robot'))}
        </span>
        <Button size="compact-md" leftSection={<IconSend size={14} />} disabled={!isOpen || block !== null} onClick={send}>
          Send
        </Button>
      </div>
      <Answer store={store} />
    </div>
  )
}

/** What came back last, where the connector also talks. */
function Answer({ store }: { store: AnyStore }) {
  const latest = useLatest(store, 300)
  return latest === null ? null : <pre className={classes.answer}>{prettyJson(latest.data)}</pre>
}

/** Nothing leaves the page now: somebody else commands, or the robot is stopped. */
function blockedText({ code }: SendBlock): string {
  const { sentence, cure } = reasonOf(code)
  return `${sentence} ${cure}`.trim()
}

function refusedText(refusal: Refusal): Said {
  return { tone: 'bad', text: refusalText(refusal), after: null }
}

function sentText(isAccepted: boolean, isAway: boolean): string {
  if (isAway) return isAccepted ? 'Goes out when the connection is back' : 'Not taken while the connection is away'
  return isAccepted ? 'Sent' : 'The link did not take it; try again'
}
