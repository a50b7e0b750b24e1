import { useReadable } from '@mosaic/react'
import { useEffect, useRef, useState, type RefObject } from 'react'
import type { ShowsMedia } from '../stores/storeKinds'
import { record, type Recording } from '../pictures/pictureFiles'

const NO_STREAM = { get: () => null, subscribe: () => () => {} }
const ENDED_BY_ITSELF = 'The picture ended, and the recording with it. What there was is saved.'

export interface RecordedPicture {
  stream: MediaStream | null
  isRecording: boolean
  /** Why the last recording ended without a press; empty where it did not. */
  ending: string
  toggle: () => void
}

/**
 * The picture, while somebody looks or records it in this browser: whoever does neither doesn't listen, and the robot
 * sends, encodes and captures nothing. A recording ends with a press, with the stream, or with the widget; what there is
 * is saved.
 */
export function useRecording(label: string, store: ShowsMedia, isOnScreen: boolean): RecordedPicture {
  const [isRecording, setIsRecording] = useState(false)
  const [ending, setEnding] = useState('')
  const recording = useRef<Recording | null>(null)
  const stream = useReadable(isOnScreen || isRecording ? store.mediaStream : NO_STREAM)
  useEffect(() => (isRecording ? store.keep() : undefined), [store, isRecording])
  useEffect(
    () => () => {
      if (end(recording)) setEnding(ENDED_BY_ITSELF)
    },
    [stream],
  )
  const begin = (from: MediaStream) => {
    const begun = record(label, from, () => {
      if (recording.current === begun) setEnding(ENDED_BY_ITSELF)
      // Another one may have begun while this one was being saved.
      if (recording.current !== null && recording.current !== begun) return
      recording.current = null
      setIsRecording(false)
    })
    recording.current = begun
    setEnding('')
    setIsRecording(true)
  }
  const toggle = () => {
    if (!end(recording) && stream !== null) begin(stream)
  }
  return { stream, isRecording, ending, toggle }
}

/** False where nothing is being recorded. */
function end(recording: RefObject<Recording | null>): boolean {
  const ended = recording.current
  recording.current = null
  ended?.end()
  return ended !== null
}
