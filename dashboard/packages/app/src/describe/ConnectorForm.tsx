import { Autocomplete, Button, Group, NativeSelect, NumberInput, Text, TextInput } from '@mantine/core'
import { DATA_TYPES, describedEntry, ORIGINAL_TYPES, typeOf, type CatalogueEntry, type DescribedConnector, type MosaicDataType } from '@mosaic/client'
import { widgets, widgetsFor } from '@mosaic/widgets'
import { useState, type SubmitEvent } from 'react'
import { DATA_TYPE_TITLES, travelText, widgetOfValue } from './description'
import classes from './describe.module.css'
import { TryOutLine } from './TryOutLine'
import type { TryOut } from './useTryOut'

const TYPES = Object.values(ORIGINAL_TYPES).filter(({ half, source }) => half === undefined && source === 'robot')
/** Channels of one label, at most. */
const MOST_CHANNELS = 64

export interface ConnectorFormProps {
  robotId: string
  isBusy: boolean
  /** True once it is kept. */
  onAdd: (connector: DescribedConnector) => Promise<boolean>
}

interface Draft {
  label: string
  type: string
  dataType: MosaicDataType | ''
  widget: string
  parallelNum: number
}

/** What a try-out fills in. */
const GUESSED = { dataType: '', widget: '', parallelNum: 0 } as const
const EMPTY: Draft = { label: '', type: '', ...GUESSED }

/** One connector by hand: its label, what travels there, how it is shown; or found out by listening. */
export function ConnectorForm({ robotId, isBusy, onAdd }: ConnectorFormProps) {
  const [draft, setDraft] = useState(EMPTY)
  const [tried, setTried] = useState<{ label: string; attempt: number } | null>(null)
  const [isNumbered, setIsNumbered] = useState(false)
  const forget = () => {
    setTried(null)
    setIsNumbered(false)
  }
  const change = (more: Partial<Draft>) => setDraft((before) => ({ ...before, ...more }))
  const changeByHand = (more: Partial<Draft>) => {
    // What was heard was heard on the former label.
    const isOther = tried !== null && more.label !== undefined && more.label.trim() !== tried.label
    change(isOther ? { ...GUESSED, ...more } : more)
    if (isOther) forget()
  }
  const connector = connectorOf(draft)
  const entry = describedEntry(connector)
  const label = draft.label.trim()
  // Nothing comes on the label itself: the card would stay empty for ever.
  const needsCount = isNumbered && draft.parallelNum === 0
  const submit = async (event: SubmitEvent<HTMLFormElement>) => {
    event.preventDefault()
    if (label === '' || entry === null || needsCount || !(await onAdd(connector))) return
    setDraft(EMPTY)
    forget()
  }
  const take = (found: TryOut) => {
    change(draftOf(found))
    setIsNumbered(found.isNumbered)
  }
  return (
    <form className={classes.form} onSubmit={(event) => void submit(event)} aria-label="Describe a connector by hand">
      <Fields draft={draft} entry={entry} onChange={changeByHand} />
      {tried !== null && <TryOutLine key={tried.attempt} {...{ robotId }} label={tried.label} onTake={take} />}
      <Group justify="flex-end" gap="sm">
        {label !== '' && entry === null && (
          <Text size="xs" c="dimmed" className={classes.grow}>
            Choose a type or say what travels there; or try the label.
          </Text>
        )}
        {needsCount && (
          <Text size="xs" c="dimmed" className={classes.grow}>
            It comes on numbered channels: say how many.
          </Text>
        )}
        <Button variant="default" disabled={label === ''} onClick={() => setTried({ label, attempt: (tried?.attempt ?? 0) + 1 })}>
          Try this label
        </Button>
        <Button type="submit" loading={isBusy} disabled={label === '' || entry === null || needsCount}>
          Add
        </Button>
      </Group>
    </form>
  )
}

interface FieldsProps {
  draft: Draft
  /** What they say so far; null: nobody knows what travels there. */
  entry: CatalogueEntry | null
  onChange: (more: Partial<Draft>) => void
}

function Fields({ draft, entry, onChange }: FieldsProps) {
  return (
    <div className={classes.fields}>
      <TextInput
        label="Label"
        description="As in the robot’s YAML file"
        value={draft.label}
        onChange={(event) => onChange({ label: event.currentTarget.value })}
        required
        maxLength={200}
      />
      <Autocomplete
        label="Type"
        description="If you know it; any other is taken too"
        value={draft.type}
        onChange={(type) => onChange({ type })}
        data={TYPES.map(({ type }) => type)}
        renderOption={({ option }) => <TypeOption type={option.value} />}
        limit={30}
        comboboxProps={{ withinPortal: true }}
      />
      <NativeSelect
        label="What travels there"
        description={entry === null ? 'Try the label to find out' : travelText(entry)}
        value={draft.dataType}
        onChange={(event) => onChange({ dataType: event.currentTarget.value as Draft['dataType'], widget: '' })}
        data={[{ value: '', label: typeOf(draft.type) === undefined ? 'Not known' : 'As its type says' }, ...DATA_TYPES.map((value) => ({ value, label: DATA_TYPE_TITLES[value] }))]}
      />
      <NativeSelect
        label="Shown as"
        description="It can be changed on the card"
        value={draft.widget}
        disabled={entry === null}
        onChange={(event) => onChange({ widget: event.currentTarget.value })}
        data={[{ value: '', label: 'What fits best' }, ...(entry === null ? [] : widgetsFor(widgets, entry).map(({ id, title }) => ({ value: id, label: title })))]}
      />
      {entry?.direction === 'to-operator' && entry.dataType !== 'media' && (
        <NumberInput
          label="Numbered channels"
          description="0: the label itself"
          value={draft.parallelNum}
          min={0}
          max={MOST_CHANNELS}
          onChange={(parallelNum) => onChange({ parallelNum: Number(parallelNum) || 0 })}
        />
      )}
    </div>
  )
}

function TypeOption({ type }: { type: string }) {
  return (
    <span className={classes.option}>
      <span>{type}</span>{' '}
      <small>{typeOf(type)?.title}</small>
    </span>
  )
}

function connectorOf({ label, type, dataType, widget, parallelNum }: Draft): DescribedConnector {
  return {
    connectorId: label.trim() || '?',
    connectorType: type.trim(),
    ...(dataType === '' ? {} : { dataType }),
    ...(widget === '' ? {} : { widget }),
    ...(parallelNum > 0 ? { params: { parallelNum } } : {}),
  }
}

/** What was heard fills the form; a person still decides. */
function draftOf({ guess, isNumbered }: TryOut): Partial<Draft> {
  if (guess === null) return {}
  const widget = widgetOfValue(guess.dataType, guess.value) ?? ''
  return { dataType: guess.dataType, widget, ...(isNumbered ? { parallelNum: 1 } : {}) }
}
