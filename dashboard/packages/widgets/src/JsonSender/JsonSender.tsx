import { Button } from '@mantine/core'
import { useControl } from '@mosaic/react'
import { IconSend } from '@tabler/icons-react'
import { useSender } from './useSender'
import { MessageEditor } from '../form/MessageEditor'
import { useMessageDraft } from '../form/useMessageDraft'
import type { WidgetProps } from '../registry/WidgetDefinition'
import { prettyJson } from '../RawJson/prettyJson'
import type { AnyStore } from '../stores/storeKinds'
import { useLatest } from '../stores/useReceived'
import { ValueCards } from '../ValueCards/ValueCards'
import classes from './JsonSender.module.css'

/**
 * Sends what is entered: a form of its schema or JSON, or plain text where the connector takes text. What the robot sends
 * back is shown as values where it says what that is.
 */
export function JsonSender({ robotId, entry, store }: WidgetProps) {
  const draft = useMessageDraft(entry.messageSchema, entry.dataType !== 'string-u2r')
  const isObserver = useControl(robotId).me?.role === 'observer'
  const sender = useSender(store, isObserver ? 'Your role is observer: most robots take no messages of yours' : 'Ctrl+Enter sends')
  const send = () => {
    const { checked } = draft
    if (checked.ok) sender.send(checked.text)
    else sender.fail(checked.problem)
  }
  return (
    <div className={classes.root}>
      <MessageEditor name={`Message to ${entry.label}`} draft={draft} onSend={send} />
      <div className={classes.foot}>
        <span className={classes.said} role="status" data-tone={sender.said.tone}>
          {sender.said.text}
        </span>
        <Button size="compact-md" leftSection={<IconSend size={14} />} disabled={!sender.canSend} onClick={send}>
          Send
        </Button>
      </div>
      {entry.sentSchema === undefined ? (
        <Answer store={store} />
      ) : (
        <div className={classes.values}>
          <ValueCards robotId={robotId} entry={entry} store={store} />
        </div>
      )}
    </div>
  )
}

/** What came back last, where the connector also talks. */
function Answer({ store }: { store: AnyStore }) {
  const latest = useLatest(store, 300)
  return latest === null ? null : <pre className={classes.answer}>{prettyJson(latest.data)}</pre>
}
