import { Button, TextInput } from '@mantine/core'
import { messages, type CatalogueEntry } from '@mosaic/client'
import { useMemo, useState } from 'react'
import { jointsOf, limitedNames, rangeOf, sliderRange, type Joint } from '../Joints/joints'
import { JsonSender } from '../JsonSender/JsonSender'
import { useSender } from '../JsonSender/useSender'
import type { WidgetProps } from '../registry/WidgetDefinition'
import { jsonOf } from '../stores/decode'
import type { AnyStore } from '../stores/storeKinds'
import { useConnectorStore } from '../stores/useConnectorStore'
import { useEntries } from '../stores/useEntries'
import { useLatest } from '../stores/useReceived'
import { isThere, knownNames, shownPosition, targetAfter, targetOf, typedNumber, type JointDraft } from './jointDraft'
import classes from './JointCommand.module.css'
import { SendRow } from './SendRow'
import { SliderRow } from './SliderRow'
import { useKeptTarget } from './useKeptTarget'

/** Said no longer than this, beyond the time that a person typed: an arm that isn't there by then won't get there. */
const LASTS_S = 10

interface Kept {
  draft: JointDraft
  durationS: number | null
}

const JOINT_STATES: readonly string[] = [messages.SCHEMA_IDS.JointState]

interface FormProps extends WidgetProps {
  /** What a person has touched. */
  draft: JointDraft
  onDraft: (change: (before: JointDraft) => JointDraft) => void
}

/** A slider for each joint, from where the joint stands; sent at a press, under the lease like every command. */
export function JointCommand(props: WidgetProps) {
  const [state] = useEntries(props.robotId, JOINT_STATES)
  // Held here, so that what was touched stays while it becomes known where the joints are.
  const [draft, setDraft] = useState<JointDraft>({})
  const form = { ...props, draft, onDraft: setDraft }
  return state === undefined ? <JointForm {...form} reported={[]} /> : <WithState {...form} state={state} />
}

function WithState({ state, ...props }: FormProps & { state: CatalogueEntry }) {
  const store = useConnectorStore(props.robotId, state.label, state.dataType)
  return store === null ? <JointForm {...props} reported={[]} /> : <Following {...props} joints={store} />
}

function Following({ joints, ...props }: FormProps & { joints: AnyStore }) {
  const latest = useLatest(joints)
  const reported = useMemo(() => {
    const decoded = latest === null ? null : jsonOf(latest.data)
    return (decoded?.ok === true ? jointsOf(decoded.value) : null) ?? []
  }, [latest])
  return <JointForm {...props} reported={reported} />
}

function JointForm({ reported, draft, onDraft, ...props }: FormProps & { reported: readonly Joint[] }) {
  const { entry, store } = props
  const [duration, setDuration] = useState('')
  const sender = useSender(store, 'What you have not touched stays where it is')
  const kept = useKeptTarget<Kept>({
    entry,
    store,
    message: ({ draft, durationS }, elapsedS) => targetAfter(draft, durationS, elapsedS),
    isReached: ({ draft }) => isThere(draft, reported),
    lastsS: ({ durationS }) => LASTS_S + (durationS ?? 0),
  })
  const names = knownNames(reported, limitedNames(entry.safety, 'positions'))
  const durationS = typedNumber(duration, 0)
  const isWrong = duration.trim() !== '' && durationS === null
  const target = targetOf(draft, durationS)
  // Nobody says which joints there are: a person who knows writes them.
  if (names.length === 0) return <JsonSender {...props} />
  return (
    <div className={classes.root}>
      <div className={classes.sliders} role="group" aria-label={`Target of ${entry.label}`}>
        {names.map((name) => {
          const value = shownPosition(draft, reported, name)
          const range = sliderRange(rangeOf(entry.safety, `positions.${name}`), value)
          const isTouched = name in draft
          return (
            <SliderRow
              key={name}
              {...{ name, value, isTouched, ...range }}
              unit="rad"
              onChange={(position) => onDraft((before) => ({ ...before, [name]: position }))}
            />
          )
        })}
      </div>
      <SendRow
        sender={sender}
        isReady={target !== null && !isWrong}
        onHold={kept.target === null ? null : kept.end}
        onSend={() => {
          if (!sender.send(JSON.stringify(target))) return
          kept.keep({ draft: { ...kept.target?.draft, ...draft }, durationS })
          onDraft(() => ({}))
        }}
      >
        <TextInput
          className={classes.number}
          size="xs"
          inputMode="decimal"
          aria-label="Be there in (s)"
          placeholder="in … s"
          value={duration}
          error={isWrong}
          onChange={(event) => setDuration(event.currentTarget.value)}
        />
        <Button size="compact-md" variant="default" disabled={target === null} onClick={() => onDraft(() => ({}))}>
          Undo
        </Button>
      </SendRow>
    </div>
  )
}
