import { Button } from '@mantine/core'
import { reasonOf } from '@mosaic/client'
import { useReadable } from '@mosaic/react'
import { IconCamera, IconFolder, IconPlayerPauseFilled, IconPlayerPlayFilled, IconPlayerRecordFilled, IconPlayerStopFilled } from '@tabler/icons-react'
import { useState } from 'react'
import { Notice } from '../frame/Notice'
import { lazyDialog } from '../registry/lazyDialog'
import type { WidgetProps } from '../registry/WidgetDefinition'
import classes from './Recorder.module.css'
import { formattedBytes, formattedDuration, type OneRecording, type RecorderStatus } from './recorderMessages'
import { useRecorder, type RecorderControl } from './useRecorder'

const RecordedFiles = lazyDialog(() => import('./RecordedFiles'))

const STATES = { idle: 'Not recording', recording: 'Recording', paused: 'Paused' }
const STATES_OF_ONE: Record<string, string> = {
  starting: 'starting',
  recording: 'recording',
  waiting: 'waiting for a picture',
  paused: 'paused',
  ended: 'ended',
}

/** Records on the robot: start, pause, go on, end, stills, and the files that lie there. */
export function Recorder({ entry, store }: WidgetProps) {
  const recorder = useRecorder(store)
  const [showsFiles, setShowsFiles] = useState(false)
  const isOpen = useReadable(store.state).phase === 'open'
  const { status, said, command } = recorder
  if (status === null) return <Notice tone="wait" title="Waiting for the recorder" />
  return (
    <div className={classes.root}>
      <div className={classes.head} data-state={status.state} role="status">
        <strong>{STATES[status.state]}</strong>
        {status.state !== 'idle' && <span className={classes.time}>{formattedDuration(status.seconds)}</span>}
        {status.freeBytes !== null && <span className={classes.free}>{formattedBytes(status.freeBytes)} free</span>}
      </div>
      <div className={classes.buttons} role="group" aria-label={`Recorder ${entry.label}`}>
        <Transport status={status} recorder={recorder} isOpen={isOpen} />
        <Button size="sm" variant="default" leftSection={<IconCamera size={16} />} disabled={!isOpen} onClick={recorder.snapshot}>
          Still
        </Button>
        <Button
          size="sm"
          variant="default"
          leftSection={<IconFolder size={16} />}
          disabled={!isOpen}
          onClick={() => {
            command('list')
            setShowsFiles(true)
          }}
        >
          Files
        </Button>
      </div>
      {status.recordings.length === 0 ? (
        <span className={classes.row}>{status.labels.join(', ')}</span>
      ) : (
        <ul className={classes.cameras}>
          {status.recordings.map((one) => (
            <One key={one.label} recording={one} />
          ))}
        </ul>
      )}
      <span className={classes.said} role="status">
        {said}
      </span>
      {showsFiles && <RecordedFiles recorder={recorder} onClose={() => setShowsFiles(false)} />}
    </div>
  )
}

function Transport({ status, recorder: { command }, isOpen }: { status: RecorderStatus; recorder: RecorderControl; isOpen: boolean }) {
  if (status.state === 'idle') {
    return (
      <Button size="sm" variant="light" color="red" leftSection={<IconPlayerRecordFilled size={16} />} disabled={!isOpen} onClick={() => command('start')}>
        Record
      </Button>
    )
  }
  const isPaused = status.state === 'paused'
  return (
    <>
      <Button size="sm" variant="light" color="red" leftSection={<IconPlayerStopFilled size={16} />} disabled={!isOpen} onClick={() => command('stop')}>
        End
      </Button>
      <Button
        size="sm"
        variant="default"
        leftSection={isPaused ? <IconPlayerPlayFilled size={16} /> : <IconPlayerPauseFilled size={16} />}
        disabled={!isOpen}
        onClick={() => command(isPaused ? 'resume' : 'pause')}
      >
        {isPaused ? 'Go on' : 'Pause'}
      </Button>
    </>
  )
}

function One({ recording: { kind, label, state, seconds, bytes, messages, dropped, code } }: { recording: OneRecording }) {
  return (
    <li className={classes.row} data-bad={code !== ''}>
      <strong>{label}</strong> {STATES_OF_ONE[state] ?? state} · {formattedDuration(seconds)} · {formattedBytes(bytes)}
      {kind === 'data' && ` · ${messages} messages`}
      {dropped > 0 && ` · ${dropped} ${kind === 'data' ? 'messages' : 'pictures'} lost: the disk is too slow`}
      {code !== '' && <span>{reasonOf(code).sentence}</span>}
    </li>
  )
}
