/**
 * Carries out what `driveControl` decides: owns the clock and every event of the page that must end a hold.
 * One per mounted pad; `dispose` stops the robot.
 */
import {
  handleDrive,
  INITIAL_DRIVE,
  needsTicks,
  type DriveEvent,
  type DriveLimits,
  type DriveState,
  type Stick,
  type StopReason,
  type Twist,
} from './driveControl'
import { makeDriveClock, type DriveClock, type MakeDriveClock } from './driveClock'
import { driveKeyOf, releasedKeyOf } from './driveKeys'
import { driveStatus, type DriveStatus } from './driveStatus'

export interface DriveSessionOptions {
  limits: DriveLimits
  /** Returns false where the channel did not take the command. */
  send: (twist: Twist) => boolean
  page?: Window
  makeClock?: MakeDriveClock
  nowMs?: () => number
}

/** The pad that keys belong to: the newest, or the one touched last. Two pads must never obey one key. */
const keyboard: { owner: DriveSession | null } = { owner: null }

export class DriveSession {
  private state: DriveState = INITIAL_DRIVE
  private isTicking = false
  private notAccepted = false
  private said = driveStatus(INITIAL_DRIVE, false)
  private readonly listeners = new Set<() => void>()
  private readonly clock: DriveClock
  private readonly page: Window
  private readonly nowMs: () => number
  private readonly detached = new AbortController()

  constructor(private readonly options: DriveSessionOptions) {
    this.page = options.page ?? window
    this.nowMs = options.nowMs ?? (() => performance.now())
    this.clock = (options.makeClock ?? makeDriveClock)(() => this.dispatch({ type: 'tick' }))
    keyboard.owner ??= this
    this.listenToPage()
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

  moveStick(stick: Stick): void {
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
    this.clock.dispose()
    if (keyboard.owner === this) keyboard.owner = null
  }

  private dispatch(event: DriveEvent): void {
    const { state, send } = handleDrive(this.state, event, this.nowMs(), this.options.limits)
    const changed = state !== this.state
    this.state = state
    if (send !== null) this.notAccepted = !this.options.send(send)
    this.followTicks()
    if (changed) this.tell()
  }

  private tell(): void {
    const status = driveStatus(this.state, this.notAccepted)
    if (status.text !== this.said.text || status.tone !== this.said.tone) this.said = status
    for (const listener of [...this.listeners]) listener()
  }

  private followTicks(): void {
    const wanted = needsTicks(this.state)
    if (wanted === this.isTicking) return
    this.isTicking = wanted
    if (wanted) this.clock.start()
    else this.clock.stop()
  }

  private listenToPage(): void {
    const { signal } = this.detached
    const page = this.page
    page.addEventListener('keydown', (event) => this.onKeyDown(event), { signal })
    page.addEventListener('keyup', (event) => this.onKeyUp(event), { signal })
    page.addEventListener('blur', () => this.stop('blur'), { signal })
    page.addEventListener('pagehide', () => this.stop('pagehide'), { signal })
    page.document.addEventListener(
      'visibilitychange',
      () => {
        if (page.document.visibilityState === 'hidden') this.stop('hidden')
      },
      { signal },
    )
  }

  private onKeyDown(event: KeyboardEvent): void {
    keyboard.owner ??= this
    if (keyboard.owner !== this) return
    if (event.metaKey || event.ctrlKey || event.altKey) return this.stop('released')
    const key = driveKeyOf(event)
    if (key === null) return
    if (this.state.enabled) event.preventDefault()
    if (key === 'stop') return this.stop('stop-key')
    // A repeat belongs to a press that has ended here (blur, a stop): moving again takes a new one.
    if (!event.repeat) this.dispatch({ type: 'keyDown', key })
  }

  private onKeyUp(event: KeyboardEvent): void {
    const key = releasedKeyOf(event.code)
    if (key !== null) this.dispatch({ type: 'keyUp', key })
  }
}
