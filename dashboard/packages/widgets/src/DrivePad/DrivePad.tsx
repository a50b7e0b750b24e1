import { Slider } from '@mantine/core'
import { reasonOf, type Refusal } from '@mosaic/client'
import { useReadable } from '@mosaic/react'
import { IconChevronDown, IconChevronLeft, IconChevronRight, IconChevronUp } from '@tabler/icons-react'
import { useEffect, useId, useRef, useState, useSyncExternalStore, type PointerEvent, type RefObject } from 'react'
import type { WidgetProps } from '../registry/WidgetDefinition'
import { refuses } from '../stores/storeKinds'
import { INITIAL_DRIVE, limitsOf, MIN_SPEED, stickOfKeys, twistOf, type DriveLimits } from './driveControl'
import classes from './DrivePad.module.css'
import type { DriveSession } from './DriveSession'
import { driveStatus, type DriveStatus } from './driveStatus'
import { stickAt, thumbOffset } from './padGeometry'
import { useDriveSession } from './useDriveSession'

/** How long a refusal stays in sight after the last one. */
const REFUSAL_SHOWN_MS = 4000

/** Drives the robot while it is held: by pointer, touch, WASD or arrow keys. */
export function DrivePad({ entry, store }: WidgetProps) {
  const limits = limitsOf(entry.safety)
  const session = useDriveSession(store, limits)
  const status = useDriveStatus(session)
  const refusal = useRecentRefusal(store)
  const readout = useRef<HTMLSpanElement>(null)
  const describedBy = useId()
  return (
    <div className={classes.root}>
      <div className={classes.wide}>
        <Pad session={session} limits={limits} tone={status.tone} readout={readout} describedBy={describedBy} />
        <div className={classes.foot}>
          <Speed session={session} limits={limits} />
          <div className={classes.readout}>
            <span ref={readout} data-testid="velocity" />
          </div>
          <div
            className={classes.status}
            data-tone={refusal === null ? status.tone : 'refused'}
            role="status"
            data-testid="drive-status"
          >
            {refusal === null ? status.text : refusalText(refusal)}
          </div>
          <div className={classes.hint} id={describedBy}>
            Hold WASD or the arrow keys; let go to stop. Space stops at once.
          </div>
        </div>
      </div>
    </div>
  )
}

interface PadProps {
  session: DriveSession | null
  limits: DriveLimits
  tone: DriveStatus['tone']
  readout: RefObject<HTMLSpanElement | null>
  describedBy: string
}

function Pad({ session, limits, tone, readout, describedBy }: PadProps) {
  const thumb = useRef<HTMLDivElement>(null)
  useEffect(() => {
    const paint = () => paintDrive(session, limits, thumb.current, readout.current)
    paint()
    return session?.subscribe(paint)
  }, [session, limits, readout])
  return (
    <div
      className={classes.pad}
      data-tone={tone}
      data-testid="drive-pad"
      role="application"
      aria-roledescription="drive pad"
      aria-label="Drive pad"
      aria-describedby={describedBy}
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
  limits: DriveLimits,
  thumb: HTMLElement | null,
  readout: HTMLElement | null,
): void {
  const state = session?.get() ?? INITIAL_DRIVE
  const stick = state.stick ?? stickOfKeys(state.keys)
  if (thumb !== null) {
    const { xPercent, yPercent } = thumbOffset(stick)
    thumb.style.left = `${50 + xPercent}%`
    thumb.style.top = `${50 + yPercent}%`
  }
  if (readout !== null) {
    const { linear, angular } = twistOf(state, limits)
    readout.textContent = `${linear.x.toFixed(2)} m/s · ${angular.z.toFixed(2)} rad/s`
  }
}

function Speed({ session, limits }: { session: DriveSession | null; limits: DriveLimits }) {
  const [percent, setPercent] = useState(INITIAL_DRIVE.speed * 100)
  useEffect(() => session?.setSpeed(percent / 100), [session, percent])
  const atMost = `${((limits.maxLinearMps * percent) / 100).toFixed(2)} m/s · ${((limits.maxAngularRadps * percent) / 100).toFixed(2)} rad/s`
  return (
    <div>
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
  const snapshot = useSyncExternalStore(session?.subscribe ?? NOBODY, () => session?.status ?? WAITING)
  return snapshot
}

const WAITING = driveStatus(INITIAL_DRIVE, false)

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

function refusalText(refusal: Refusal): string {
  const reason = reasonOf(refusal.code)
  return `Refused: ${refusal.message ?? reason.sentence} ${reason.cure}`.trim()
}
