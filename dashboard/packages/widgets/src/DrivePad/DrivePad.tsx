import { ActionIcon, Slider, Tooltip } from '@mantine/core'
import { driveOf, type DriveCommand, type Refusal } from '@mosaic/client'
import { useControl, useLimits, useReadable } from '@mosaic/react'
import { IconAlertTriangle, IconChevronDown, IconChevronLeft, IconChevronRight, IconChevronUp, IconDeviceGamepad2 } from '@tabler/icons-react'
import { useEffect, useId, useRef, useState, useSyncExternalStore, type PointerEvent, type RefObject } from 'react'
import { limitText, refusalText, type LimitText } from '../control/controlText'
import { gamepadHint } from '../gamepad/gamepadHint'
import { pageGamepads } from '../gamepad/GamepadSource'
import { lazyDialog } from '../registry/lazyDialog'
import type { WidgetProps } from '../registry/WidgetDefinition'
import { refuses } from '../stores/storeKinds'
import { velocityText } from './driveCommand'
import { INITIAL_DRIVE, MIN_SPEED } from './driveControl'
import { askedStick, limitsOf, twistOf, type DriveLimits } from './driveTwist'
import classes from './DrivePad.module.css'
import type { DriveSession } from './DriveSession'
import { driveStatus, driveStatusWith, type DriveStatus } from './driveStatus'
import { stickAt, thumbOffset } from './padGeometry'
import { useDriveSession } from './useDriveSession'

const GamepadEditor = lazyDialog(() => import('../gamepad/GamepadEditor'))

/** How long a refusal stays in sight after the last one. */
const REFUSAL_SHOWN_MS = 4000

/** Drives the robot while it is held: by pointer, touch, WASD, arrow keys or gamepad. */
export function DrivePad({ robotId, entry, store }: WidgetProps) {
  const limits = limitsOf(entry.safety)
  const isObserver = useControl(robotId).me?.role === 'observer'
  const drive = driveOf(entry)
  const { session, permit } = useDriveSession({ robotId, entry, store, limits })
  const status = driveStatusWith(useDriveStatus(session), permit)
  const refusal = useRecentRefusal(store)
  const limit = limitText(useLimits(robotId, entry.label))
  const readout = useRef<HTMLSpanElement>(null)
  const describedBy = useId()
  return (
    <div className={classes.root} data-limit={limit?.tone ?? 'none'} data-permit={permit.permit}>
      <div className={classes.wide}>
        <Pad session={session} {...{ drive, limits, readout, describedBy }} tone={status.tone} />
        <div className={classes.foot}>
          <Speed session={session} {...{ drive, limits, limit }} />
          <div className={classes.readout}>
            <span ref={readout} data-testid="velocity" />
            <GamepadButton />
          </div>
          <div
            className={classes.status}
            data-tone={refusal === null ? status.tone : 'refused'}
            role="status"
            data-testid="drive-status"
          >
            {refusal === null ? status.text : refusalText(refusal)}
          </div>
          {entry.safety === undefined && (
            <div className={classes.note} id={`${describedBy}-note`}>
              Nothing is known to stop this robot by itself: if the connection breaks, it may go on as last told.
            </div>
          )}
          <div className={classes.hint} id={describedBy}>
            {!isObserver && <Hint />}
          </div>
        </div>
      </div>
    </div>
  )
}

/** The keys, or the gamepad while there is one. */
function Hint() {
  const gamepad = useReadable(pageGamepads().active)
  return <>{gamepad === null ? 'Hold WASD or the arrow keys; let go to stop. Space stops at once.' : gamepadHint(gamepad)}</>
}

function GamepadButton() {
  const [isOpen, setIsOpen] = useState(false)
  const gamepad = useReadable(pageGamepads().active)
  const label = gamepad === null ? 'Set up a gamepad' : `Gamepad: ${gamepad.name}`
  return (
    <>
      <Tooltip label={label} openDelay={300}>
        <ActionIcon
          variant={gamepad === null ? 'subtle' : 'light'}
          color={gamepad === null ? 'gray' : gamepad.isTrusted ? 'signal' : 'orange'}
          size="md"
          aria-label={label}
          onClick={() => setIsOpen(true)}
        >
          <IconDeviceGamepad2 size={17} stroke={1.7} />
        </ActionIcon>
      </Tooltip>
      {isOpen && <GamepadEditor source={pageGamepads()} onClose={() => setIsOpen(false)} />}
    </>
  )
}

interface PadProps {
  session: DriveSession | null
  drive: DriveCommand | null
  limits: DriveLimits
  tone: DriveStatus['tone']
  readout: RefObject<HTMLSpanElement | null>
  describedBy: string
}

function Pad({ session, drive, limits, tone, readout, describedBy }: PadProps) {
  const thumb = useRef<HTMLDivElement>(null)
  useEffect(() => {
    const paint = () => paintDrive(session, { drive, limits }, thumb.current, readout.current)
    paint()
    return session?.subscribe(paint)
  }, [session, drive, limits, readout])
  return (
    <div
      className={classes.pad}
      data-tone={tone}
      data-testid="drive-pad"
      role="application"
      aria-roledescription="drive pad"
      aria-label="Drive pad"
      aria-describedby={`${describedBy} ${describedBy}-note`}
      aria-disabled={tone === 'waiting'}
      tabIndex={0}
      {...pointerHandlers(session)}
    >
      <IconChevronUp className={classes.arrow} data-way="forward" size={20} aria-hidden />
      <IconChevronDown className={classes.arrow} data-way="back" size={20} aria-hidden />
      <IconChevronLeft className={classes.arrow} data-way="left" size={20} aria-hidden />
      <IconChevronRight className={classes.arrow} data-way="right" size={20} aria-hidden />
      <div ref={thumb} className={classes.thumb} />
    </div>
  )
}

function pointerHandlers(session: DriveSession | null) {
  const move = (event: PointerEvent<HTMLElement>) =>
    session?.moveStick(stickAt(event.clientX, event.clientY, event.currentTarget.getBoundingClientRect()))
  return {
    onPointerDown: (event: PointerEvent<HTMLElement>) => {
      if (!event.isPrimary || event.button !== 0) return
      event.currentTarget.setPointerCapture(event.pointerId)
      move(event)
    },
    onPointerMove: (event: PointerEvent<HTMLElement>) => {
      if (session?.get().stick != null && event.currentTarget.hasPointerCapture(event.pointerId)) move(event)
    },
    onPointerUp: () => session?.stop('released'),
    onPointerCancel: () => session?.stop('pointercancel'),
    onLostPointerCapture: () => session?.stop('lostcapture'),
    // A long press must not open a menu under the driving thumb.
    onContextMenu: (event: { preventDefault(): void }) => event.preventDefault(),
  }
}

/** Moves the thumb and writes the velocity, past React: a pointer moves more often than a page should render. */
function paintDrive(
  session: DriveSession | null,
  { drive, limits }: { drive: DriveCommand | null; limits: DriveLimits },
  thumb: HTMLElement | null,
  readout: HTMLElement | null,
): void {
  const state = session?.get() ?? INITIAL_DRIVE
  const stick = askedStick(state)
  if (thumb !== null) {
    const { xPercent, yPercent } = thumbOffset(stick)
    thumb.style.left = `${50 + xPercent}%`
    thumb.style.top = `${50 + yPercent}%`
  }
  if (readout !== null) {
    const { linear, angular } = twistOf(state, limits)
    readout.textContent = velocityText(linear.x, angular.z, drive, limits)
  }
}

interface SpeedProps {
  session: DriveSession | null
  drive: DriveCommand | null
  limits: DriveLimits
  limit: LimitText | null
}

function Speed({ session, drive, limits, limit }: SpeedProps) {
  const [percent, setPercent] = useState(INITIAL_DRIVE.speed * 100)
  useEffect(() => session?.setSpeed(percent / 100), [session, percent])
  const share = percent / 100
  const atMost = velocityText(limits.maxLinearMps * share, limits.maxAngularRadps * share, drive, limits)
  return (
    <div>
      {limit !== null && (
        <div className={classes.limit} data-tone={limit.tone} data-testid="speed-limit">
          <IconAlertTriangle size={14} aria-hidden />
          <span>
            <strong>{limit.title}</strong>: {limit.why}
          </span>
        </div>
      )}
      <div className={classes.readout}>
        <span>Speed {percent} %</span>
        <span>≤ {atMost}</span>
      </div>
      <Slider
        size="md"
        mt={6}
        min={MIN_SPEED * 100}
        max={100}
        step={5}
        value={percent}
        onChange={setPercent}
        label={null}
        thumbLabel="Speed in per cent of the robot's limits"
      />
    </div>
  )
}

const NOBODY = () => () => {}

function useDriveStatus(session: DriveSession | null): DriveStatus {
  return useSyncExternalStore(session?.subscribe ?? NOBODY, () => session?.status ?? WAITING)
}

const WAITING = driveStatus(INITIAL_DRIVE)

function useRecentRefusal(store: WidgetProps['store']): Refusal | null {
  const last = useReadable(refuses(store) ? store.lastRefusal : NO_REFUSAL)
  const [forgotten, setForgotten] = useState<Refusal | null>(null)
  useEffect(() => {
    if (last === null) return undefined
    const timer = setTimeout(() => setForgotten(last), REFUSAL_SHOWN_MS)
    return () => clearTimeout(timer)
  }, [last])
  return last === forgotten ? null : last
}

const NO_REFUSAL = { get: () => null, subscribe: NOBODY }

