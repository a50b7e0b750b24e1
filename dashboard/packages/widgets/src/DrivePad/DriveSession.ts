/**
 * Carries out what `driveControl` decides: owns the clock and every event of the page that must end a hold.
 * One per mounted pad; `dispose` stops the robot.
 */
import { pageTicks, type Ticks } from '@mosaic/client'
import { pads } from '../control/pads'
import { pageGamepads, type GamepadSource } from '../gamepad/GamepadSource'
import type { Stick } from '../gamepad/stick'
import { handleDrive, INITIAL_DRIVE, needsTicks, TICK_MS, type DriveEvent, type DrivePermit, type DriveState, type EndOfPermit, type StopReason } from './driveControl'
import type { DriveLimits, Twist } from './driveTwist'
import { driveKeyOf, releasedKeyOf } from './driveKeys'
import { driveStatus, type DriveStatus } from './driveStatus'

export interface DriveSessionOptions {
  /** Whose base it drives: a stop of that robot ends the hold here. */
  robotId?: string
  limits: DriveLimits
  /** False: nothing is known that stops the robot when it is told nothing more. */
  stopsItself?: boolean
  /** Returns false where the channel did not take the command. */
  send: (twist: Twist) => boolean
  /** A touch while nobody commands: ask for the lease. */
  takeLease?: () => void
  /** The gamepad's stop button went down. */
  stopRobot?: () => void
  page?: Window
  ticks?: Ticks
  gamepads?: GamepadSource
  nowMs?: () => number
}

/** The pad that keys and the gamepad belong to: the newest, or the one touched last. Two must never obey one key. */
const keyboard: { owner: DriveSession | null } = { owner: null }

export class DriveSession {
  readonly robotId: string
  private state: DriveState = INITIAL_DRIVE
  private endTicks: (() => void) | null = null
  private notAccepted = false
  private said = driveStatus(INITIAL_DRIVE)
  private readonly listeners = new Set<() => void>()
  private readonly page: Window
  private readonly gamepads: GamepadSource
  private readonly nowMs: () => number
  private readonly detached = new AbortController()

  constructor(private readonly options: DriveSessionOptions) {
    this.robotId = options.robotId ?? ''
    this.page = options.page ?? window
    this.gamepads = options.gamepads ?? pageGamepads()
    this.nowMs = options.nowMs ?? (() => performance.now())
    keyboard.owner ??= this
    pads.add(this)
    this.listenToPage()
    this.followTicks()
  }

  readonly get = (): DriveState => this.state

  readonly subscribe = (listener: () => void): (() => void) => {
    this.listeners.add(listener)
    return () => this.listeners.delete(listener)
  }

  /** What to say about it; the same object until it changes. */
  get status(): DriveStatus {
    return this.said
  }

  /** Follows the connection: without an open channel nothing is held. */
  setOpen(isOpen: boolean): void {
    this.dispatch(isOpen ? { type: 'enabled' } : { type: 'stop', reason: 'disconnected' })
  }

  /** Follows the lease and the stop: without a permit nothing is held; `reason` says which of them took it. */
  setPermit(permit: DrivePermit, reason: EndOfPermit): void {
    this.dispatch({ type: 'permit', permit, reason })
  }

  moveStick(stick: Stick): void {
    // A gamepad that drives another pad is seen by that one no more: it must end there, and starts nothing here.
    if (keyboard.owner !== this && keyboard.owner?.state.gamepad != null) keyboard.owner.stop('released')
    keyboard.owner = this
    this.dispatch({ type: 'stick', stick })
  }

  setSpeed(speed: number): void {
    this.dispatch({ type: 'speed', speed })
  }

  stop(reason: StopReason): void {
    this.dispatch({ type: 'stop', reason })
  }

  dispose(): void {
    this.stop('unmount')
    this.detached.abort()
    this.endTicks?.()
    pads.delete(this)
    if (keyboard.owner === this) keyboard.owner = null
  }

  private dispatch(event: DriveEvent): void {
    const before = this.state
    const { state, send, takesLease } = handleDrive(before, event, this.nowMs(), this.options.limits)
    this.state = state
    const gamepadIsOut = state.gamepad === null && (before.gamepad !== null || event.type === 'gamepad')
    if (gamepadIsOut && event.type !== 'gamepadReleased') this.gamepads.disarm()
    if (send !== null) this.notAccepted = !this.options.send(send)
    if (takesLease) this.options.takeLease?.()
    this.followTicks()
    if (state !== before) this.tell()
  }

  private tell(): void {
    const { notAccepted: isBlocked } = this
    const status = driveStatus(this.state, { isBlocked, stopsItself: this.options.stopsItself ?? true })
    if (status.text !== this.said.text || status.tone !== this.said.tone) this.said = status
    for (const listener of [...this.listeners]) listener()
  }

  /** The clock runs while somebody holds, while zeros are owed, and while there is a gamepad to look at. */
  private followTicks(): void {
    const isWanted = !this.detached.signal.aborted && (needsTicks(this.state) || this.gamepads.active.get() !== null)
    if (isWanted === (this.endTicks !== null)) return
    this.endTicks?.()
    this.endTicks = isWanted ? (this.options.ticks ?? pageTicks).every(TICK_MS, () => this.tick()) : null
  }

  private tick(): void {
    this.lookAtGamepad()
    this.dispatch({ type: 'tick' })
  }

  private lookAtGamepad(): void {
    keyboard.owner ??= this
    if (keyboard.owner !== this) return
    const { stick, hasEnded, asksForStop } = this.gamepads.look()
    if (asksForStop) this.options.stopRobot?.()
    // Without the focus only its stop counts: whoever works in another window is not looking at the robot.
    if (stick !== null && this.page.document.hasFocus()) this.dispatch({ type: 'gamepad', stick })
    else if (stick !== null) this.stop('blur')
    else if (!hasEnded && this.state.gamepad === null) return
    else if (this.gamepads.active.get() === null) this.stop('unplugged')
    else this.dispatch({ type: 'gamepadReleased' })
  }

  private listenToPage(): void {
    const { signal } = this.detached
    const page = this.page
    page.addEventListener('keydown', (event) => this.onKeyDown(event), { signal })
    page.addEventListener('keyup', (event) => this.onKeyUp(event), { signal })
    page.addEventListener('blur', () => this.stop('blur'), { signal })
    // Told before the page is left, while its channels still carry: zeros go out until it is.
    page.addEventListener('beforeunload', () => this.stop('pagehide'), { signal })
    page.addEventListener('pagehide', () => this.stop('pagehide'), { signal })
    // An unplugged gamepad must not wait for a tick.
    page.addEventListener('gamepaddisconnected', () => this.lookAtGamepad(), { signal })
    page.document.addEventListener('visibilitychange', () => this.onVisibility(), { signal })
    const unsubscribe = this.gamepads.active.subscribe(() => this.followTicks())
    signal.addEventListener('abort', unsubscribe)
  }

  private onVisibility(): void {
    if (this.page.document.visibilityState === 'hidden') this.stop('hidden')
  }

  private onKeyDown(event: KeyboardEvent): void {
    keyboard.owner ??= this
    if (keyboard.owner !== this) return
    if (event.metaKey || event.ctrlKey || event.altKey) return this.stop('released')
    const key = driveKeyOf(event)
    if (key === null) return
    if (this.state.enabled && key !== 'escape') event.preventDefault()
    if (key === 'stop') return this.stop('stop-key')
    if (key === 'escape') return this.stop('escape')
    // A repeat belongs to a press that has ended here (blur, a stop): moving again takes a new one.
    if (!event.repeat) this.dispatch({ type: 'keyDown', key })
  }

  private onKeyUp(event: KeyboardEvent): void {
    const key = releasedKeyOf(event.code)
    if (key !== null) this.dispatch({ type: 'keyUp', key })
  }
}
