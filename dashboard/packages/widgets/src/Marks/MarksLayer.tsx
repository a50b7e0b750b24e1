import { messages, nowMs, type MessageInfo } from '@mosaic/client'
import { useReadable, useRobotConnection } from '@mosaic/react'
import { useEffect, useRef, useState, type RefObject } from 'react'
import { useCanvas } from '../paint/useCanvas'
import { onEveryFrame } from '../pictures/everyFrame'
import { EachMessage } from '../stores/EachMessage'
import type { ShowsMedia } from '../stores/storeKinds'
import { useEntries } from '../stores/useEntries'
import { MarkLog, marksOf, markText, placementOf, type Marks } from './marks'
import classes from './Marks.module.css'
import { paintMarks } from './paintMarks'

const ANNOTATIONS: readonly string[] = [messages.SCHEMA_IDS.ImageAnnotations]
/** Marks that are this late are still drawn, but faintly: what they mark may have moved on. */
const LATE_MS = 400

export interface MarksLayerProps {
  robotId: string
  /** Of the camera. */
  label: string
  store: Pick<ShowsMedia, 'latestPicture'>
  video: RefObject<HTMLVideoElement | null>
}

/** What connectors of the robot mark in this camera's pictures, each on the picture that it was found in. */
export default function MarksLayer({ robotId, label, store, video }: MarksLayerProps) {
  const connection = useRobotConnection(robotId)
  const entries = useEntries(robotId, ANNOTATIONS)
  const isOnlyCamera = useReadable(connection.catalogue)?.entries.filter(({ kind }) => kind === 'video').length === 1
  const [logs] = useState(() => new Map<string, MarkLog>())
  const note = useRef<HTMLSpanElement>(null)

  const { canvas, repaint } = useCanvas((surface) => {
    const element = video.current
    const picture = store.latestPicture
    const shown = picture === null || element === null ? [] : [...logs.values()].map((log) => log.at(picture.shownAtMs - (picture.ageMs ?? 0)))
    const now: Marks[] = []
    for (const found of shown) {
      if (found === null || element === null) continue
      const size = found.marks.size ?? { width: element.videoWidth, height: element.videoHeight }
      if (size.width === 0 || size.height === 0) continue
      surface.context.globalAlpha = found.lateMs > LATE_MS ? 0.4 : 1
      paintMarks(surface, found.marks, placementOf(size, surface))
      now.push(found.marks)
    }
    surface.context.globalAlpha = 1
    const text = now.map(markText).filter(Boolean).join(', ')
    if (note.current !== null && note.current.textContent !== text) note.current.textContent = text
  })
  useEffect(() => (video.current === null ? undefined : onEveryFrame(video.current, repaint)), [video, repaint])

  const take = (source: string, message: unknown, info?: MessageInfo) => {
    const marks = marksOf(message)
    if (marks === null || (marks.camera === null ? !isOnlyCamera : marks.camera !== label)) return
    const log = logs.get(source) ?? new MarkLog()
    logs.set(source, log)
    const atMs = marks.capturedUs === null ? null : connection.control.toPageMs(marks.capturedUs)
    const receivedAtMs = info?.receivedAtMs ?? nowMs()
    log.add(marks, atMs ?? receivedAtMs - (info?.ageMs ?? 0))
    repaint()
  }
  return (
    <>
      <canvas ref={canvas} className={classes.canvas} aria-hidden />
      <span className={classes.note} role="note" aria-label={`Marks in ${label}`} ref={note} data-testid="marks" />
      {entries.map((entry) => (
        <EachMessage key={entry.label} robotId={robotId} entry={entry} onMessage={(message, info) => take(entry.label, message, info)} />
      ))}
    </>
  )
}
