import { Button, TextInput } from '@mantine/core'
import { useReadable, useRobotConnection } from '@mosaic/react'
import { useCallback, useMemo, useState } from 'react'
import { reportedJoints, reportsFor, takenNames, type Heard } from '../Joints/jointPairs'
import type { Joint } from '../Joints/joints'
import { JsonSender } from '../JsonSender/JsonSender'
import { useSender } from '../JsonSender/useSender'
import type { WidgetProps } from '../registry/WidgetDefinition'
import { isThere, knownNames, ofNames, targetAfter, targetOf, typedNumber, type JointDraft } from './jointDraft'
import classes from './JointCommand.module.css'
import { JointRow } from './JointRow'
import { ReportOf } from './ReportOf'
import { SendRow } from './SendRow'
import { useKeptTarget } from './useKeptTarget'

/** Said no longer than this, beyond the time that a person typed: an arm that isn't there by then won't get there. */
const LASTS_S = 10

interface Kept {
  draft: JointDraft
  durationS: number | null
}

/** A slider for each joint that it takes, from where the joint stands; a number to type where nobody knows that. Sent at
 *  a press, under the lease like every command. */
export function JointCommand(props: WidgetProps) {
  const { robotId, entry } = props
  const catalogue = useReadable(useRobotConnection(robotId).catalogue)
  const reports = useMemo(() => reportsFor(catalogue?.entries ?? [], entry), [catalogue, entry])
  const [heard, setHeard] = useState<Heard>({})
  const hear = useCallback((label: string, joints: readonly Joint[]) => setHeard((before) => ({ ...before, [label]: joints })), [])
  const reported = useMemo(() => reportedJoints(reports, heard, entry), [reports, heard, entry])
  return (
    <>
      {reports.map((report) => (
        <ReportOf key={report.label} robotId={robotId} report={report} onJoints={hear} />
      ))}
      <JointForm {...props} reported={reported} />
    </>
  )
}

interface FormProps extends WidgetProps {
  reported: readonly Joint[]
}

function JointForm({ reported, ...props }: FormProps) {
  const { entry, store } = props
  const [touched, setTouched] = useState<JointDraft>({})
  const [duration, setDuration] = useState('')
  const sender = useSender(store, 'What you have not touched stays where it is')
  const kept = useKeptTarget<Kept>({
    entry,
    store,
    message: ({ draft, durationS }, elapsedS) => targetAfter(draft, durationS, elapsedS),
    isReached: ({ draft }) => isThere(draft, reported),
    lastsS: ({ durationS }) => LASTS_S + (durationS ?? 0),
  })
  const names = entry.itemNames ?? knownNames(reported, takenNames(entry))
  const draft = ofNames(touched, names)
  const durationS = typedNumber(duration, 0)
  const isNoTime = duration.trim() !== '' && durationS === null
  const target = targetOf(draft, durationS)
  // Nobody says which joints there are: a person who knows writes them.
  if (names.length === 0) return <JsonSender {...props} />
  return (
    <div className={classes.root}>
      <div className={classes.sliders} role="group" aria-label={`Target of ${entry.label}`}>
        {names.map((name) => (
          <JointRow key={name} {...{ name, entry, reported, draft }} onDraft={setTouched} />
        ))}
      </div>
      <SendRow
        sender={sender}
        isReady={target !== null && !isNoTime}
        onHold={kept.target === null ? null : kept.end}
        onSend={() => {
          if (!sender.send(JSON.stringify(target))) return
          kept.keep({ draft: { ...kept.target?.draft, ...draft }, durationS })
          setTouched({})
        }}
      >
        <TextInput
          className={classes.number}
          size="xs"
          inputMode="decimal"
          aria-label="Be there in (s)"
          placeholder="in … s"
          value={duration}
          error={isNoTime}
          onChange={(event) => setDuration(event.currentTarget.value)}
        />
        <Button size="compact-md" variant="default" disabled={target === null} onClick={() => setTouched({})}>
          Undo
        </Button>
      </SendRow>
    </div>
  )
}
