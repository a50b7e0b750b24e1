import { useEffect, useRef, useState } from 'react'
import { record, type Recording } from './pictureFiles'

/** Recording in this browser: it ends with a press, with the stream, or with the widget; what there is is saved. */
export function useRecording(label: string, stream: MediaStream | null): { isRecording: boolean; toggle: () => void } {
  const [isRecording, setIsRecording] = useState(false)
  const recording = useRef<Recording | null>(null)
  useEffect(
    () => () => {
      recording.current?.end()
      recording.current = null
    },
    [stream],
  )
  const toggle = () => {
    if (recording.current !== null) {
      recording.current.end()
      recording.current = null
    } else if (stream !== null) {
      recording.current = record(label, stream, () => setIsRecording(false))
      setIsRecording(true)
    }
  }
  return { isRecording, toggle }
}
