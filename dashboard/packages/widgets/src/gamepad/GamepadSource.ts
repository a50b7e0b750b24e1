/**
 * Reads the gamepad of this page: which one counts, what it says, and its mapping. One per page; it is looked at from the
 * clock that also sends commands, so that a throttled page reads no slower than it drives.
 */
import { Value, type Readable } from '@mosaic/client'
import { disarmed, handleReading, NEW_HOLD, type GamepadHold, type GamepadStep } from './gamepadHold'
import { STANDARD_MAPPING, type GamepadMapping, type GamepadReading } from './gamepadMapping'
import {
  forgetMapping,
  gamepadName,
  readMapping,
  writeMapping,
  type GamepadKind,
  type KnownMapping,
  type MappingStorage,
} from './gamepadStorage'

/** The gamepad in use. */
export interface ActiveGamepad extends KnownMapping {
  index: number
  kind: GamepadKind
  name: string
}

export interface GamepadSourceOptions {
  page?: Window
  storage?: MappingStorage
}

export class GamepadSource {
  private readonly chosen = new Value<ActiveGamepad | null>(null)
  private readonly page: Window
  private readonly storage: MappingStorage
  private readonly detached = new AbortController()
  private hold: GamepadHold = NEW_HOLD
  private lookedAt: number | null = null
  private editors = 0

  /** Null while no gamepad is connected; browsers show one only after its first button. */
  readonly active: Readable<ActiveGamepad | null> = this.chosen

  constructor(options: GamepadSourceOptions = {}) {
    this.page = options.page ?? window
    this.storage = options.storage ?? this.page.localStorage
    const { signal } = this.detached
    const choose = (): void => this.choose()
    this.page.addEventListener('gamepadconnected', choose, { signal })
    this.page.addEventListener('gamepaddisconnected', choose, { signal })
    this.choose()
  }

  /** What the gamepad asks for now. One that nobody has looked at, or that is being edited, asks for nothing. */
  look(): GamepadStep {
    this.choose()
    const active = this.chosen.get()
    const isSame = active !== null && active.index === this.lookedAt
    this.lookedAt = active?.index ?? null
    const mayAct = isSame && active.isTrusted && this.editors === 0
    const step = handleReading(this.hold, mayAct ? this.reading() : null, active?.mapping ?? STANDARD_MAPPING)
    this.hold = step.hold
    return step
  }

  /** Driving was ended from elsewhere: the gamepad must be released before it counts again. */
  disarm(): void {
    this.hold = disarmed(this.hold)
  }

  /** The raw axes and buttons; null without a gamepad. */
  reading(): GamepadReading | null {
    const active = this.chosen.get()
    return active === null ? null : (this.connected().find(({ index }) => index === active.index) ?? null)
  }

  /** While somebody edits the mapping, buttons are pressed to be seen, not to drive. The result ends it. */
  beginEditing(): () => void {
    this.editors += 1
    let isEditing = true
    return () => {
      if (isEditing) this.editors -= 1
      isEditing = false
    }
  }

  /** Use this mapping from now on, for every gamepad of this kind; false where the browser can't remember it. */
  keepMapping(mapping: GamepadMapping): boolean {
    const active = this.chosen.get()
    if (active === null) return false
    this.disarm()
    this.chosen.set({ ...active, mapping, isTrusted: true })
    return writeMapping(this.storage, active.kind, mapping)
  }

  /** Back to what is known of this kind of gamepad. */
  forgetMapping(): void {
    const active = this.chosen.get()
    if (active === null) return
    this.disarm()
    forgetMapping(this.storage, active.kind)
    this.chosen.set({ ...active, ...readMapping(this.storage, active.kind) })
  }

  dispose(): void {
    this.detached.abort()
  }

  /** Stay with the one in use; without one, take the one that somebody touches, or the first. */
  private choose(): void {
    const connected = this.connected()
    const active = this.chosen.get()
    if (active !== null && connected.some(({ index, id }) => index === active.index && id === active.kind.id)) return
    const next = connected.find(({ buttons }) => buttons.some(({ pressed }) => pressed)) ?? connected[0]
    // Another one in the place of this one must be looked at as new.
    this.lookedAt = null
    this.chosen.set(next === undefined ? null : this.activeOf(next))
  }

  private activeOf({ index, id, mapping }: Gamepad): ActiveGamepad {
    const kind = { id, mapping }
    return { index, kind, name: gamepadName(id), ...readMapping(this.storage, kind) }
  }

  private connected(): Gamepad[] {
    try {
      return this.page.navigator.getGamepads().filter((one): one is Gamepad => one?.connected === true)
    } catch {
      // Forbidden by a policy, or a browser without gamepads.
      return []
    }
  }
}

let shared: GamepadSource | null = null

/** The one that all pads and the editor of this page share. */
export function pageGamepads(): GamepadSource {
  return (shared ??= new GamepadSource())
}
