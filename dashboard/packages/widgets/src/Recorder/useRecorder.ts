import { randomId, reasonOf } from '@mosaic/client'
import { useReadable } from '@mosaic/react'
import { useRef, useState } from 'react'
import { refusalText } from '../control/controlText'
import { download } from '../frame/download'
import { refuses, sends, type AnyStore } from '../stores/storeKinds'
import { useEveryJson } from '../stores/useReceived'
import { recorderMessage, type FileList, type RecorderStatus, type SnapshotTaken } from './recorderMessages'

export interface RecorderControl {
  status: RecorderStatus | null
  files: FileList | null
  /** What came of the last thing that was asked for. */
  said: string
  /** False: the link did not take it. */
  command: (name: 'start' | 'stop' | 'pause' | 'resume' | 'list') => void
  remove: (file: string) => void
  snapshot: () => void
}

/** A recorder on the robot: what it does now, its files, and the commands for it. */
export function useRecorder(store: AnyStore): RecorderControl {
  const [status, setStatus] = useState<RecorderStatus | null>(null)
  const [files, setFiles] = useState<FileList | null>(null)
  const [said, setSaid] = useState('')
  /** Stills that this page asked for; others' are none of its business. */
  const asked = useRef('')
  const refusal = useReadable(refuses(store) ? store.lastRefusal : NOTHING)
  const [seen, setSeen] = useState(refusal)
  if (refusal !== seen) {
    setSeen(refusal)
    if (refusal !== null) setSaid(refusalText(refusal))
  }
  useEveryJson(store, (value) => {
    const message = recorderMessage(value)
    if (message?.type === 'status') setStatus(message)
    if (message?.type === 'files') setFiles(message)
    if (message?.type === 'snapshot' && message.requestId === asked.current) setSaid(kept(message))
  })
  const send = (command: object) => {
    const isTaken = sends(store) && store.sendData(JSON.stringify(command))
    setSaid(isTaken ? '' : 'The link did not take it; try again')
  }
  return {
    status,
    files,
    said,
    command: (name) => send({ command: name }),
    remove: (file) => send({ command: 'delete', files: [file] }),
    snapshot: () => {
      asked.current = randomId()
      send({ command: 'snapshot', send: true, request_id: asked.current })
    },
  }
}

const NOTHING = { get: () => null, subscribe: () => () => {} }

/** The still lies on the robot; here it goes to the downloads as well. */
function kept({ label, file, code, pngBase64 }: SnapshotTaken): string {
  if (code !== '') return `No still of ${label}: ${reasonOf(code).sentence}`
  if (pngBase64 === null) return `The robot kept ${file}; it is too large to be sent`
  const bytes = Uint8Array.from(atob(pngBase64), (character) => character.charCodeAt(0))
  download(file, new Blob([bytes], { type: 'image/png' }))
  return `The robot kept ${file}, and so did this browser`
}
