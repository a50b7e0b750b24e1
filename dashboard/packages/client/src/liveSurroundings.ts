/** What the control desk and the picture reports are given of whatever connection is live at the moment. */
import type { CatalogueEntry } from '@mosaic/protocol'
import type { DeskSurroundings } from './control/ControlDesk'
import type { PictureSurroundings } from './control/PictureReporter'
import type { PeerAttempt } from './PeerAttempt'
import type { Platform } from './Platform'
import type { ConnectionPhase } from './types'

export interface Live {
  readonly attempt: () => PeerAttempt | null
  readonly phase: () => ConnectionPhase
  readonly entryOf: (label: string) => CatalogueEntry | null
}

const COMING: ReadonlySet<ConnectionPhase> = new Set(['connecting', 'connected', 'reconnecting'])

export function deskSurroundings(platform: Platform, { attempt, phase, entryOf }: Live): DeskSurroundings {
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

export function pictureSurroundings(platform: Platform, { attempt }: Pick<Live, 'attempt'>): PictureSurroundings {
  return {
    now: () => platform.now(),
    every: (periodMs, onTick) => platform.ticks.every(periodMs, onTick),
    send: (seen) => attempt()?.control.send('media.seen', seen) ?? false,
    captureUs: (rtpTimestamp, atMs, origin) => attempt()?.control.captureUs(rtpTimestamp, atMs, origin) ?? null,
  }
}
