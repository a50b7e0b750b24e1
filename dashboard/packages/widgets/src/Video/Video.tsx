import { ActionIcon } from '@mantine/core'
import { useReadable, useRobotConnection } from '@mosaic/react'
import { IconMaximize } from '@tabler/icons-react'
import { useEffect, useEffectEvent, useRef, useState } from 'react'
import { Notice } from '../frame/Notice'
import type { WidgetProps } from '../registry/WidgetDefinition'
import { showsMedia, type ShowsMedia } from '../stores/storeKinds'
import type { PictureState } from './frameMeter'
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
  const facts = useRef<HTMLDivElement>(null)
  const alarm = useRef<HTMLDivElement>(null)
  const [state, setState] = useState<PictureState>('none')
  const stream = useReadable(store.mediaStream)
  const connection = useRobotConnection(robotId)
  const statistics = useReadable(store.statistics)
  const measured = useEffectEvent(() => ({ statistics, roundTripMs: connection.state.get().roundTripMs }))
  useEffect(() => {
    if (video.current === null || facts.current === null || alarm.current === null) return undefined
    return playPicture(
      { video: video.current, facts: facts.current, alarm: alarm.current },
      {
        stream,
        measured: () => measured(),
        pictureAgeMs: (rtpTimestamp, atMs) => store.pictureAgeMs(rtpTimestamp, atMs),
        onState: setState,
      },
    )
  }, [store, stream])
  return (
    <div ref={root} className={classes.root} data-state={state} data-testid="video">
      <video ref={video} className={classes.video} autoPlay muted playsInline aria-label={`Picture of ${entry.label}`} />
      {state === 'none' && (
        <div className={classes.empty}>
          <Notice tone="wait" title={stream === null ? 'No picture' : 'No picture yet'}>
            {stream === null ? 'Waiting for the connection.' : 'Connected; waiting for the first frame.'}
          </Notice>
        </div>
      )}
      <div ref={alarm} className={classes.alarm} role="alert" />
      <div ref={facts} className={classes.facts} data-testid="picture-facts" />
      <ActionIcon
        className={classes.fullscreen}
        variant="filled"
        color="dark.5"
        aria-label={`Show ${entry.label} on the whole screen`}
        onClick={() => toggleFullscreen(root.current, video.current)}
      >
        <IconMaximize size={16} color="#e7ecf2" />
      </ActionIcon>
    </div>
  )
}

function toggleFullscreen(root: HTMLElement | null, video: HTMLVideoElement | null): void {
  if (document.fullscreenElement !== null) void document.exitFullscreen()
  else if (root?.requestFullscreen !== undefined) void root.requestFullscreen()
  // iPhones put only the video itself on the whole screen.
  else (video as { webkitEnterFullscreen?: () => void } | null)?.webkitEnterFullscreen?.()
}
