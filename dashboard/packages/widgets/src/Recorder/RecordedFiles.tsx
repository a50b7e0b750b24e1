import { ActionIcon, Modal } from '@mantine/core'
import { IconTrash } from '@tabler/icons-react'
import { HoldButton } from '../control/HoldButton'
import { useState } from 'react'
import classes from './Recorder.module.css'
import { formattedBytes, type RecordedFile } from './recorderMessages'
import type { RecorderControl } from './useRecorder'

/** The files that lie on the robot, newest first, and a way to delete them. */
export default function RecordedFiles({ recorder, onClose }: { recorder: RecorderControl; onClose: () => void }) {
  const { files, said } = recorder
  return (
    <Modal opened onClose={onClose} size="lg" title="Recordings on the robot">
      {files !== null && <p className={classes.folder}>In {files.directory}, on the robot’s disk.</p>}
      {files?.files.length === 0 && <p className={classes.folder}>There are none.</p>}
      <ul className={classes.files}>
        {files?.files.map((file) => (
          <File key={file.name} file={file} onDelete={() => recorder.remove(file.name)} />
        ))}
      </ul>
      <span className={classes.said} role="status">
        {said}
      </span>
    </Modal>
  )
}

function File({ file: { name, bytes, modifiedAtS, isOpen }, onDelete }: { file: RecordedFile; onDelete: () => void }) {
  const [isAsking, setIsAsking] = useState(false)
  return (
    <li>
      <span className={classes.file}>
        <strong>{name}</strong>
        <span>
          {formattedBytes(bytes)} · {WHEN.format(modifiedAtS * 1000)}
          {isOpen && ' · being written'}
        </span>
      </span>
      {isAsking ? (
        <HoldButton color="red" size="compact-sm" holding="Keep holding…" onHeld={onDelete}>
          Hold to delete
        </HoldButton>
      ) : (
        <ActionIcon variant="subtle" color="gray" aria-label={`Delete ${name}`} disabled={isOpen} onClick={() => setIsAsking(true)}>
          <IconTrash size={16} />
        </ActionIcon>
      )}
    </li>
  )
}

const WHEN = new Intl.DateTimeFormat(undefined, { dateStyle: 'medium', timeStyle: 'short' })
