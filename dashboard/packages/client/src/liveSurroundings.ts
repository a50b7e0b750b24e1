/** What the parts of a `RobotConnection` are given of whatever connection is live at the moment. */
import type { CatalogueEntry } from '@mosaic/protocol'
import type { DeskSurroundings } from './control/ControlDesk'
import type { PictureSurroundings } from './control/PictureReporter'
import type { PeerAttempt } from './peers/PeerAttempt'
import type { Platform } from './platform/Platform'
import { receiverSource } from './bindings/receiverSource'
import type { BindingHost } from './bindings/StoreBindings'
import type { ConnectionPhase } from './words/types'

export interface Live {
  readonly attempt: () => PeerAttempt | null
  readonly phase: () => ConnectionPhase
}

const COMING: ReadonlySet<ConnectionPhase> = new Set(['connecting', 'connected', 'reconnecting'])

type EntryOf = (label: string) => CatalogueEntry | null

export function deskSurroundings(platform: Platform, { attempt, phase }: Live, entryOf: EntryOf): Omit<DeskSurroundings, 'sendOn' | 'hasSentOn'> {
  return {
    now: () => platform.now(),
    every: (periodMs, onTick) => platform.ticks.every(periodMs, onTick),
    isVisible: () => platform.isVisible(),
    isComing: () => COMING.has(phase()),
    send: (type, data) => attempt()?.control.send(type, data) ?? false,
    sendStop: (stop) => attempt()?.stop.send(stop) ?? false,
    toPageMs: (robotUs) => attempt()?.control.clocks.toOursMs(robotUs) ?? null,
    entryOf,
  }
}

export interface BindingWishes extends Pick<BindingHost, 'watch' | 'clearanceOf' | 'streams' | 'bulkCarrier' | 'lineMissing'> {
  /** A picture is on the screen. */
  readonly shown: (label: string, rtpTimestamp: number, atMs: number) => void
  /** A message of a connector has arrived. */
  readonly valueArrived: (label: string) => void
}

export function bindingHost(platform: Platform, { attempt }: Pick<Live, 'attempt'>, wishes: BindingWishes): BindingHost {
  const control = () => attempt()?.control ?? null
  const now = (): number => platform.now()
  return {
    now,
    clock: () => control()?.clocks ?? null,
    watch: (label, on) => wishes.watch(label, on),
    valueArrived: (label) => wishes.valueArrived(label),
    mediaSource: (label, receiver) =>
      receiverSource(receiver, { now, control, shown: (rtp, atMs) => wishes.shown(label, rtp, atMs) }),
    clearanceOf: (entry) => wishes.clearanceOf(entry),
    bulkCarrier: (main) => wishes.bulkCarrier(main),
    lineMissing: () => wishes.lineMissing(),
    streams: wishes.streams,
  }
}

export function pictureSurroundings(platform: Platform, { attempt }: Pick<Live, 'attempt'>): PictureSurroundings {
  return {
    now: () => platform.now(),
    every: (periodMs, onTick) => platform.ticks.every(periodMs, onTick),
    send: (seen) => attempt()?.control.send('media.seen', seen) ?? false,
    captureUs: (rtpTimestamp, atMs, origin) => attempt()?.control.captureUs(rtpTimestamp, atMs, origin) ?? null,
  }
}
