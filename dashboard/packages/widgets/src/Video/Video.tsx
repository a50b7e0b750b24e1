import { messages, reasonOf, type StoreState } from '@mosaic/client'
import { useReadable, useRobotConnection } from '@mosaic/react'
import { useEffect, useEffectEvent, useRef, useState } from 'react'
import { ControlFrame } from '../control/ControlFrame'
import { ControlNews } from '../control/ControlNews'
import { LeaseRequests } from '../control/LeaseRequests'
import { StopButton } from '../control/StopButton'
import { StoppedBanner } from '../control/StoppedBanner'
import { download, fileName } from '../frame/download'
import { LastPictureAge } from '../frame/LastPictureAge'
import { Notice } from '../frame/Notice'
import { fetched } from '../registry/fetched'
import type { WidgetProps } from '../registry/WidgetDefinition'
import { showsMedia, type ShowsMedia } from '../stores/storeKinds'
import { useEntries } from '../stores/useEntries'
import { useStoreState } from '../stores/useStoreState'
import type { PictureState } from '../pictures/frameMeter'
import { KeptCanvas } from './KeptCanvas'
import { KeptPicture } from '../pictures/KeptPicture'
import { bufferTargetMs, readPictureChoices, writePictureChoices, type PictureChoices } from '../pictures/pictureChoices'
import { canRecord, saveStill, snapshot } from '../pictures/pictureFiles'
import { PictureLog } from '../pictures/PictureLog'
import { csvOf, jsonOf } from '../pictures/pictureRecords'
import { PictureTools } from './PictureTools'
import { useFirstFrame } from './useFirstFrame'
import { useFullscreen } from './useFullscreen'
import { useKeptPicture } from './useKeptPicture'
import { useOnScreen } from './useOnScreen'
import { useShown } from './useShown'
import { useRecording } from './useRecording'
import classes from './Video.module.css'
import { playPicture } from './VideoPlayer'

/** Comes where the robot marks something in its pictures. */
const MarksLayer = fetched(() => import('../Marks/MarksLayer').then((file) => file.default, () => NoMarks))
const ANNOTATIONS: readonly string[] = [messages.SCHEMA_IDS.ImageAnnotations]

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
  useShown(robotId, store, root)
  const { stream, ...recording } = useRecording(entry.label, store, isOnScreen)
  const [log] = useState(() => new PictureLog())
  const [last] = useState(() => new KeptPicture())
  const [failure, setFailure] = useState('')
  const isFullscreen = useFullscreen(root)
  const hasMarks = useEntries(robotId, ANNOTATIONS).length > 0
  const { state, facts, alarm } = usePlayer({ store, robotId, video, stream, log, last, showsDetails: choices.showsDetails })
  const kept = useKeptPicture(store, last, state)
  const storeState = useStoreState(store)
  const isAway = storeState.phase === 'reconnecting'
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
    <div ref={root} className={classes.root} data-state={isAway ? 'reconnecting' : state} data-testid="video">
      <video ref={video} className={classes.video} autoPlay muted playsInline aria-label={`Picture of ${entry.label}`} />
      {kept !== null && <KeptCanvas label={entry.label} canvas={kept} />}
      {hasMarks && choices.showsMarks && state === 'live' && <MarksLayer {...{ robotId, store, video }} label={entry.label} />}
      {state === 'none' && !(isAway && kept !== null) && <NoPicture {...{ isOnScreen, storeState }} hasStream={stream !== null} code={missing} />}
      <div ref={alarm} className={classes.alarm} role="alert" />
      <div ref={facts} className={classes.facts} data-details={choices.showsDetails} data-testid="picture-facts" />
      {isFullscreen && <ControlOverPicture robotId={robotId} />}
      {isFullscreen && isAway && (
        <div className={classes.away}>
          Reconnecting <LastPictureAge store={store} />
        </div>
      )}
      {recording.isRecording && <div className={classes.recording}>Recording</div>}
      {(failure || recording.ending) !== '' && (
        <div className={classes.failure} role="alert">
          {failure || recording.ending}
        </div>
      )}
      <PictureTools
        label={entry.label}
        hasPicture={state !== 'none'}
        hasMarks={hasMarks}
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

/** The picture stays without them. */
function NoMarks() {
  return (
    <div className={classes.failure} role="alert">
      What is marked could not be fetched; reload the page to see it
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
  /** Why there is none although there is a track, where that is known. */
  code: string | null
  storeState: StoreState
}

function NoPicture({ hasStream, isOnScreen, code: missing, storeState }: NoPictureProps) {
  const code = missing ?? (storeState.phase === 'closed' ? storeState.code : undefined)
  if (code !== undefined) {
    const { sentence, cure } = reasonOf(code)
    return (
      <div className={classes.empty} data-code={code}>
        <Notice tone="bad" title={(missing === null ? storeState.message : undefined) ?? sentence}>
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
  last: KeptPicture
  showsDetails: boolean
}

function usePlayer({ store, robotId, video, stream, log, last, showsDetails }: PlayerSurroundings) {
  const facts = useRef<HTMLDivElement>(null)
  const alarm = useRef<HTMLDivElement>(null)
  const [seen, setSeen] = useState<{ stream: MediaStream | null; state: PictureState }>({ stream: null, state: 'none' })
  const connection = useRobotConnection(robotId)
  const statistics = useReadable(store.statistics)
  const measured = useEffectEvent(() => ({ statistics, roundTripMs: connection.state.get().roundTripMs }))
  const wantsDetails = useEffectEvent(() => showsDetails)
  useEffect(() => {
    const element = video.current
    if (element === null || facts.current === null || alarm.current === null) return undefined
    // Right after the store loses it, its connection is closed.
    const unsubscribe = stream === null ? () => {} : store.mediaStream.subscribe(() => last.keep(element))
    const stop = playPicture(
      { video: element, facts: facts.current, alarm: alarm.current },
      {
        stream,
        beganMs: log.beganMs,
        measured: () => measured(),
        pictureShown: (rtpTimestamp, atMs) => {
          store.pictureShown(rtpTimestamp, atMs)
          return store.displayedAgeMs.get()
        },
        showsDetails: () => wantsDetails(),
        onState: (state) => setSeen((before) => (before.stream === stream && before.state === state ? before : { stream, state })),
        onRecord: (record) => log.add(record),
        onEnd: () => {
          if (store.mediaStream.get() === stream) last.keep(element)
        },
      },
    )
    return () => {
      unsubscribe()
      stop()
    }
  }, [store, stream, video, log, last])
  // What was seen of another stream says nothing of this one.
  return { state: seen.stream === stream ? seen.state : 'none', facts, alarm }
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
