import { ActionIcon, NativeSelect, Switch, Textarea, TextInput } from '@mantine/core'
import { IconBraces, IconForms } from '@tabler/icons-react'
import type { Field } from '../schema/jsonSchema'
import { groupedFields } from '../schema/groupedFields'
import { choicesOf, keyOf, readInput } from './messageForm'
import classes from './form.module.css'
import type { MessageDraft } from './useMessageDraft'

interface MessageEditorProps {
  /** What a screen reader calls it. */
  name: string
  draft: MessageDraft
  /** Ctrl+Enter. */
  onSend: () => void
}

/** Where a person enters a message: an input per field of its schema, or JSON. */
export function MessageEditor({ name, draft, onSend }: MessageEditorProps) {
  const { fields } = draft
  return (
    <div
      className={classes.editor}
      onKeyDown={(event) => {
        if (event.key === 'Enter' && (event.ctrlKey || event.metaKey)) onSend()
      }}
    >
      {fields === null ? (
        <Textarea
          className={classes.text}
          aria-label={name}
          value={draft.text}
          spellCheck={false}
          onChange={(event) => draft.type(event.currentTarget.value)}
        />
      ) : (
        <div className={classes.fields} role="group" aria-label={name}>
          {groupedFields(fields).map(({ heading, fields: grouped }) => (
            <fieldset key={heading} className={classes.group}>
              {heading !== '' && <legend>{heading}</legend>}
              {grouped.map((field) => (
                <FieldInput key={keyOf(field)} field={field} draft={draft} />
              ))}
            </fieldset>
          ))}
        </div>
      )}
      {draft.hasForm && <FormSwitch isForm={fields !== null} onTurn={draft.turn} />}
    </div>
  )
}

function FormSwitch({ isForm, onTurn }: { isForm: boolean; onTurn: () => void }) {
  const words = isForm ? 'Write it as JSON' : 'Fill in a form'
  return (
    <ActionIcon className={classes.switch} variant="subtle" color="gray" size="sm" aria-label={words} title={words} onClick={onTurn}>
      {isForm ? <IconBraces size={14} /> : <IconForms size={14} />}
    </ActionIcon>
  )
}

function FieldInput({ field, draft }: { field: Field; draft: MessageDraft }) {
  const input = draft.inputOf(field)
  const label = field.unit === '' ? field.name : `${field.name} (${field.unit})`
  const shared = { label, size: 'xs', title: field.description || keyOf(field) } as const
  const choices = choicesOf(field)
  if (typeof input === 'boolean') {
    return <Switch {...shared} checked={input} onChange={(event) => draft.fill(field, event.currentTarget.checked)} />
  }
  if (choices !== null) {
    return <NativeSelect {...shared} data={choices} value={input} onChange={(event) => draft.fill(field, event.currentTarget.value)} />
  }
  const read = readInput(field, input)
  return (
    <TextInput
      {...shared}
      inputMode={field.kind === 'number' ? 'decimal' : 'text'}
      spellCheck={false}
      placeholder={field.isOptional === true ? 'not said' : ''}
      value={input}
      error={!read.ok && input !== '' && read.problem}
      onChange={(event) => draft.fill(field, event.currentTarget.value)}
    />
  )
}
