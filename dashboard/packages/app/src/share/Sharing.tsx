import { Button, Text, Title } from '@mantine/core'
import { reasonOf } from '@mosaic/client'
import { useMosaicClient, useReadable } from '@mosaic/react'
import type { CameraChoice, PageRobot, PageRobotState, Viewer } from '@mosaic/robot'
import { IconAlertTriangle, IconExternalLink, IconEye, IconEyeOff, IconPlayerStopFilled } from '@tabler/icons-react'
import { useEffect, useRef } from 'react'
import { CameraChooser } from './CameraChooser'
import type { RememberedRobot } from './rememberedRobot'
import classes from './share.module.css'
import { useAwake } from './useAwake'
import { useHiddenFor } from './useHiddenFor'
import type { Share } from './useShare'

export interface SharingProps {
  share: Share
  robot: PageRobot
  known: RememberedRobot
}

/** Shows, while a device is shared, who sees what of it, and ends it with one press. */
export function Sharing({ share, robot, known }: SharingProps) {
  const state = useReadable(robot.state)
  const isAwake = useAwake(state.refusal === null)
  return (
    <>
      <Title order={1} size="h3">
        {known.name}
      </Title>
      <div className={classes.atHand}>
        <Standing state={state} />
        <Button className={classes.stop} size="xl" leftSection={<IconPlayerStopFilled size={22} aria-hidden />} onClick={share.stop} fullWidth>
          Stop sharing
        </Button>
      </div>
      {state.refusal !== null && <Refused code={state.refusal} onForget={share.forget} onStop={share.stop} />}
      {Object.entries(state.problems).map(([label, problem]) => (
        <p key={label} className={classes.problem} role="alert">
          <IconAlertTriangle size={18} stroke={1.7} aria-hidden />
          <span>
            <strong>{label}:</strong> {problem}
          </span>
        </p>
      ))}
      <Viewers viewers={state.viewers} />
      {robot.tracks.has('camera') && <OwnPicture track={state.captured['camera'] ?? null} choice={share.camera} onChoose={share.film} />}
      <SeeIt robotId={known.robotId} />
      <Hints isAwake={isAwake} />
    </>
  )
}

function Standing({ state: { server, refusal, captured, isStopped } }: { state: PageRobotState }) {
  const on = Object.keys(captured)
  const text =
    refusal !== null
      ? 'Nobody can see this device.'
      : server !== 'online'
        ? 'Looking for the server …'
        : on.length > 0
          ? `Shared now: ${on.join(' and ')}.`
          : 'Nobody watches: camera and microphone are off.'
  return (
    <p className={classes.standing} role="status" data-live={on.length > 0} data-testid="standing">
      {text}
      {isStopped && ' Somebody said stop: the loudspeaker is silent.'}
    </p>
  )
}

function Viewers({ viewers }: { viewers: readonly Viewer[] }) {
  return (
    <section className={classes.viewers} aria-label="Who is here">
      <h2>{viewers.length === 0 ? 'Nobody is here' : 'Who is here'}</h2>
      <ul>
        {viewers.map(({ id, name, labels, isVerified }) => (
          <li key={id}>
            {labels.length > 0 ? <IconEye size={18} aria-hidden /> : <IconEyeOff size={18} aria-hidden />}
            <span>
              <strong>{name || 'Somebody'}</strong>{' '}
              {labels.length > 0 ? `gets ${labels.join(', ')}` : 'gets nothing at the moment'}
              {!isVerified && ' (by the server’s word: this browser can’t check its ticket)'}
            </span>
          </li>
        ))}
      </ul>
    </section>
  )
}

interface OwnPictureProps {
  track: MediaStreamTrack | null
  choice: CameraChoice
  onChoose: (choice: CameraChoice) => void
}

function OwnPicture({ track, choice, onChoose }: OwnPictureProps) {
  const video = useRef<HTMLVideoElement>(null)
  useEffect(() => {
    if (video.current) video.current.srcObject = track === null ? null : new MediaStream([track])
  }, [track])
  return (
    <section className={classes.own} aria-label="Your camera">
      {track !== null && <video ref={video} autoPlay muted playsInline aria-label="What they see" />}
      <CameraChooser choice={choice} onChoose={onChoose} />
    </section>
  )
}

function Hints({ isAwake }: { isAwake: boolean }) {
  const hiddenS = useHiddenFor()
  return (
    <Text size="sm" c="dimmed" role="note">
      {hiddenS > 0 && `This page was hidden for ${hiddenS} s; it shares again. `}
      Keep this page in front: most phones stop the camera of a page that is hidden or locked, and it comes back with the page.{' '}
      {isAwake ? 'The screen stays on.' : 'This browser can’t keep the screen on: let it not lock itself.'}
    </Text>
  )
}

/** In a tab of its own: leaving this page ends the sharing. */
function SeeIt({ robotId }: { robotId: string }) {
  const session = useReadable(useMosaicClient().session)
  if (session === null) return null
  return (
    <Button
      component="a"
      href={`/robots/${encodeURIComponent(robotId)}`}
      target="_blank"
      rel="noopener"
      variant="default"
      leftSection={<IconExternalLink size={18} aria-hidden />}
    >
      See it as others do
    </Button>
  )
}

interface RefusedProps {
  code: string
  onForget: () => void
  onStop: () => void
}

/** The server takes this robot no more. */
function Refused({ code, onForget, onStop }: RefusedProps) {
  const isReplaced = code === 'signal.replaced'
  const again = () => {
    onStop()
    onForget()
  }
  return (
    <div className={classes.problem} role="alert">
      <IconAlertTriangle size={18} stroke={1.7} aria-hidden />
      <div>
        <strong>{isReplaced ? 'This robot is shared from another tab now.' : reasonOf(code).sentence}</strong>{' '}
        {!isReplaced && 'It was deleted, or got a new token.'}
        {!isReplaced && (
          <Button variant="default" size="compact-sm" onClick={again}>
            Be a new robot
          </Button>
        )}
      </div>
    </div>
  )
}
