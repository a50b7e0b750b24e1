import { reasonOf } from '@mosaic/client'
import { useReadable, useRobotConnection } from '@mosaic/react'
import { useEffect, useEffectEvent, useRef, useState } from 'react'
import { ControlFrame } from '../control/ControlFrame'
import { ControlNews } from '../control/ControlNews'
import { LeaseRequests } from '../control/LeaseRequests'
import { StopButton } from '../control/StopButton'
import { StoppedBanner } from '../control/StoppedBanner'
import { download, fileName } from '../frame/download'
import { Notice } from '../frame/Notice'
import type { WidgetProps } from '../registry/WidgetDefinition'
import { showsMedia, type ShowsMedia } from '../stores/storeKinds'
import type { PictureState } from './frameMeter'
import { bufferTargetMs, readPictureChoices, writePictureChoices, type PictureChoices } from './pictureChoices'
import { canRecord, saveStill, snapshot } from './pictureFiles'
import { PictureLog } from './PictureLog'
import { csvOf, jsonOf } from './pictureRecords'
import { PictureTools } from './PictureTools'
import { useFirstFrame } from './useFirstFrame'
import { useFullscreen } from './useFullscreen'
import { useOnScreen } from './useOnScreen'
import { useRecording } from './useRecording'
import classes from './Video.module.css'
import { playPicture } from './VideoPlayer'

/** A camera's picture with what was measured about it. A frozen picture is shown as frozen. */
export function Video({ store, ...props }: WidgetProps) {
  if (!showsMedia(store)) return <Notice tone="bad" title="This connector carries no picture" />
  return <Picture store={store} {...props} />
}

function Picture({ store, robotId, entry }: Omit<WidgetProps, 'store'> & { store: ShowsMedia }) {
  const root = useRef<HTMLDivElement>(null)
  const video = useRef<HTMLVideoElement>(null)
  const { choices, choose } = usePictureChoices(robotId, entry.label)
  const isOnScreen = useOnScreen(root)
  const { stream, ...recording } = useRecording(entry.label, store, isOnScreen)
  const [log] = useState(() => new PictureLog())
  const [failure, setFailure] = useState('')
  const isFullscreen = useFullscreen(root)
  const { state, facts, alarm } = usePlayer({ store, robotId, video, stream, log, showsDetails: choices.showsDetails })
  const missing = useFirstFrame(store, stream, state)
  useEffect(() => store.setBufferTarget(bufferTargetMs(choices.buffering)), [store, choices.buffering])
  const saveSnapshot = async () => {
    try {
      if (video.current !== null) saveStill(entry.label, await snapshot(video.current))
      setFailure('')
    } catch (error) {
      setFailure(`No picture was saved: ${error instanceof Error ? error.message : String(error)}`)
    }
  }
  return (
    <div ref={root} className={classes.root} data-state={state} data-testid="video">
      <video ref={video} className={classes.video} autoPlay muted playsInline aria-label={`Picture of ${entry.label}`} />
      {state === 'none' && <NoPicture hasStream={stream !== null} isOnScreen={isOnScreen} code={missing} />}
      <div ref={alarm} className={classes.alarm} role="alert" />
      <div ref={facts} className={classes.facts} data-details={choices.showsDetails} data-testid="picture-facts" />
      {isFullscreen && <ControlOverPicture robotId={robotId} />}
      {recording.isRecording && <div className={classes.recording}>Recording</div>}
      {(failure || recording.ending) !== '' && (
        <div className={classes.failure} role="alert">
          {failure || recording.ending}
        </div>
      )}
      <PictureTools
        label={entry.label}
        hasPicture={state !== 'none'}
        choices={choices}
        onChoose={choose}
        isRecording={recording.isRecording}
        onRecord={canRecord() ? recording.toggle : null}
        onStill={() => void saveSnapshot()}
        onExport={(format) => exportFigures(entry.label, log, format)}
        onFullscreen={() => toggleFullscreen(root.current, video.current)}
      />
    </div>
  )
}

/** On the whole screen the page's own control is behind the picture. */
function ControlOverPicture({ robotId }: { robotId: string }) {
  return (
    <>
      <ControlFrame robotId={robotId} />
      <div className={classes.control}>
        <div className={classes.notices}>
          <StoppedBanner robotId={robotId} />
          <LeaseRequests robotId={robotId} />
          <ControlNews robotId={robotId} />
        </div>
        <StopButton robotId={robotId} hasKey={false} />
      </div>
    </>
  )
}

interface NoPictureProps {
  hasStream: boolean
  isOnScreen: boolean
  /** Why there is none, where that is known. */
  code: string | null
}

function NoPicture({ hasStream, isOnScreen, code }: NoPictureProps) {
  if (code !== null) {
    const { sentence, cure } = reasonOf(code)
    return (
      <div className={classes.empty} data-code={code}>
        <Notice tone="bad" title={sentence}>
          {cure} ({code})
        </Notice>
      </div>
    )
  }
  return (
    <div className={classes.empty}>
      <Notice tone="wait" title={hasStream ? 'No picture yet' : isOnScreen ? 'No picture' : 'Paused'}>
        {hasStream ? 'Connected; waiting for the first frame.' : isOnScreen ? 'Waiting for the connection.' : 'It is not on the screen.'}
      </Notice>
    </div>
  )
}

function usePictureChoices(robotId: string, label: string) {
  const [choices, setChoices] = useState(() => readPictureChoices(localStorage, robotId, label))
  const choose = (next: PictureChoices) => {
    writePictureChoices(localStorage, robotId, label, next)
    setChoices(next)
  }
  return { choices, choose }
}

interface PlayerSurroundings {
  store: ShowsMedia
  robotId: string
  video: React.RefObject<HTMLVideoElement | null>
  stream: MediaStream | null
  log: PictureLog
  showsDetails: boolean
}

function usePlayer({ store, robotId, video, stream, log, showsDetails }: PlayerSurroundings) {
  const facts = useRef<HTMLDivElement>(null)
  const alarm = useRef<HTMLDivElement>(null)
  const [state, setState] = useState<PictureState>('none')
  const connection = useRobotConnection(robotId)
  const statistics = useReadable(store.statistics)
  const measured = useEffectEvent(() => ({ statistics, roundTripMs: connection.state.get().roundTripMs }))
  const wantsDetails = useEffectEvent(() => showsDetails)
  useEffect(() => {
    if (video.current === null || facts.current === null || alarm.current === null) return undefined
    return playPicture(
      { video: video.current, facts: facts.current, alarm: alarm.current },
      {
        stream,
        measured: () => measured(),
        pictureShown: (rtpTimestamp, atMs) => {
          store.pictureShown(rtpTimestamp, atMs)
          return store.displayedAgeMs.get()
        },
        showsDetails: () => wantsDetails(),
        onState: setState,
        onRecord: (record) => log.add(record),
      },
    )
  }, [store, stream, video, log])
  return { state, facts, alarm }
}

function exportFigures(label: string, log: PictureLog, format: 'csv' | 'json'): void {
  const text = format === 'csv' ? csvOf(log.records) : jsonOf(label, log.records)
  download(`${fileName('picture', label)}.${format}`, new Blob([text], { type: format === 'csv' ? 'text/csv' : 'application/json' }))
}

function toggleFullscreen(root: HTMLElement | null, video: HTMLVideoElement | null): void {
  if (document.fullscreenElement !== null) void document.exitFullscreen()
  else if (root?.requestFullscreen !== undefined) void root.requestFullscreen()
  // iPhones put only the video itself on the whole screen.
  else (video as { webkitEnterFullscreen?: () => void } | null)?.webkitEnterFullscreen?.()
}
