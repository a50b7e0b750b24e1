import { Button } from '@mantine/core'
import type { MosaicError } from '@mosaic/client'
import { useReadable, useRequest } from '@mosaic/react'
import { IconMessageQuestion, IconX } from '@tabler/icons-react'
import { MessageEditor } from '../form/MessageEditor'
import { useMessageDraft } from '../form/useMessageDraft'
import type { WidgetProps } from '../registry/WidgetDefinition'
import { fieldValues, formatted, type FieldValue } from '../schema/messageFields'
import { blockedText } from '../stores/blockedText'
import { isGuarded } from '../stores/storeKinds'
import { wholeSentence } from '../stores/wholeSentence'
import classes from './RequestPanel.module.css'

/** Of a list in an answer; a page that shows more shows nothing. */
const MAX_ITEMS = 200

const NOTHING = { get: () => null, subscribe: () => () => {} }

/** Asks a connector that answers requests: the question, how far it is, its answer. */
export function RequestPanel({ robotId, entry, store }: WidgetProps) {
  const { phase, progress, answer, error, ask, cancel } = useRequest(robotId, entry.label)
  const draft = useMessageDraft(entry.messageSchema)
  const { checked } = draft
  const block = useReadable(isGuarded(store) ? store.sendBlocked : NOTHING)
  const isAsking = phase === 'asking'
  const isReady = useReadable(store.state).phase === 'open' && block === null && checked.ok

  const send = () => {
    if (checked.ok && isReady && !isAsking) void ask(JSON.parse(checked.text) as unknown)
  }
  return (
    <div className={classes.root}>
      <MessageEditor name={`Question to ${entry.label}`} draft={draft} onSend={send} />
      <div className={classes.foot}>
        <span className={classes.said} role="status" data-tone={phase === 'failed' || !checked.ok ? 'bad' : undefined}>
          {block !== null ? blockedText(block) : checked.ok ? stateText(phase, progress, error) : checked.problem}
        </span>
        {isAsking ? (
          <Button size="compact-md" variant="default" leftSection={<IconX size={14} />} onClick={cancel}>
            Cancel
          </Button>
        ) : (
          <Button size="compact-md" leftSection={<IconMessageQuestion size={14} />} disabled={!isReady} onClick={send}>
            Ask
          </Button>
        )}
      </div>
      {isAsking && <Bar progress={progress} />}
      {phase === 'answered' && <Answer schema={entry.answerSchema} answer={answer} />}
    </div>
  )
}

/** A bar where the progress is a share, by a number called `percent`; without one it only moves. */
function Bar({ progress }: { progress: unknown }) {
  const percent = percentOf(progress)
  return <progress className={classes.bar} aria-label="Progress" max={100} {...(percent === null ? {} : { value: percent })} />
}

function Answer({ schema, answer }: { schema: WidgetProps['entry']['answerSchema']; answer: unknown }) {
  const fields = fieldValues(schema, answer)
  if (fields.length === 0) return <pre className={classes.answer}>{JSON.stringify(answer, null, 2)}</pre>
  return (
    <dl className={classes.answer} aria-label="Answer">
      {fields.map((field) => (
        <div key={field.path.join('.')} title={field.description}>
          <dt>{field.name}</dt>
          <dd>{Array.isArray(field.value) ? <Items values={field.value} /> : inWords(field)}</dd>
        </div>
      ))}
    </dl>
  )
}

/** Whoever asks wants all of a list, such as the steps of a test. */
function Items({ values }: { values: readonly unknown[] }) {
  const left = values.length - MAX_ITEMS
  return (
    <ol className={classes.items}>
      {values.slice(0, MAX_ITEMS).map((value, index) => (
        <li key={index}>{fieldValues(undefined, value).map(named).join(', ') || formatted(value, '', true)}</li>
      ))}
      {left > 0 && <li>{`and ${left} more`}</li>}
    </ol>
  )
}

function inWords({ value, unit }: FieldValue): string {
  return `${formatted(value, unit, true)} ${unit}`.trim()
}

function named(field: FieldValue): string {
  return `${field.name} ${inWords(field)}`
}

function percentOf(progress: unknown): number | null {
  if (typeof progress !== 'object' || progress === null || !('percent' in progress)) return null
  return typeof progress.percent === 'number' ? progress.percent : null
}

function stateText(phase: string, progress: unknown, error: MosaicError | null): string {
  if (phase === 'failed' && error !== null) return `${wholeSentence(error.message)} ${error.cure}`.trim()
  if (phase === 'answered') return 'Answered'
  if (phase !== 'asking') return 'Ctrl+Enter asks'
  return fieldValues(undefined, progress).map(named).join(', ') || 'Asked'
}
