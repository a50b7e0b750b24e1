import { guarded } from '@mosaic/client/parts'
import type { TrackConnector } from './Connector'

const HELD_BACK = 'The system holds it back, as behind a locked screen; it goes on when this page is looked at.'

/** Somebody who watches or listens: the line to them. */
export interface TrackWatcher {
  sender: Pick<RTCRtpSender, 'replaceTrack'>
  /** It can't be shown, and why. */
  unavailable(problem: string): void
}

/**
 * Films, or hears, for everybody who watches, and only while somebody does: with the last watcher the camera's light goes
 * off. A camera that opens when nobody wants it any more is closed at once.
 */
export class TrackOutlet {
  private readonly watchers = new Set<TrackWatcher>()
  private track: MediaStreamTrack | null = null
  /** Counts openings, so that one that comes too late is known. */
  private opening = 0
  private isOpening = false

  constructor(
    private connector: TrackConnector,
    private readonly changed: (label: string, track: MediaStreamTrack | null, problem: string) => void,
  ) {}

  get entry(): TrackConnector['entry'] {
    return this.connector.entry
  }

  get isWatched(): boolean {
    return this.watchers.size > 0
  }

  watch(watcher: TrackWatcher): void {
    if (this.watchers.has(watcher)) return
    this.watchers.add(watcher)
    if (this.track !== null) give(watcher, this.track)
    else this.open()
  }

  unwatch(watcher: TrackWatcher): void {
    if (!this.watchers.delete(watcher)) return
    give(watcher, null)
    if (this.watchers.size === 0) this.close()
  }

  /** Another camera, or the same one once more, if it is gone or gives nothing, and is wanted. */
  reopen(connector: TrackConnector = this.connector): void {
    const isOther = connector !== this.connector
    this.connector = connector
    const isWell = this.track !== null && !this.track.muted && this.track.readyState !== 'ended'
    if (!isOther && (isWell || this.isOpening)) return
    this.close()
    if (this.watchers.size > 0) this.open()
  }

  private open(): void {
    if (this.isOpening) return
    this.isOpening = true
    this.opening += 1
    const mine = this.opening
    this.connector.open().then(
      (track) => this.opened(mine, track),
      (error: unknown) => this.failed(mine, error),
    )
  }

  private opened(mine: number, track: MediaStreamTrack): void {
    if (mine !== this.opening || this.watchers.size === 0) return track.stop()
    this.isOpening = false
    this.track = track
    track.onended = () => this.lost(track)
    track.onmute = () => this.heldBack(track)
    track.onunmute = () => this.changed(this.entry.label, track, '')
    this.changed(this.entry.label, track, '')
    for (const watcher of this.watchers) give(watcher, track)
  }

  private failed(mine: number, error: unknown): void {
    if (mine !== this.opening) return
    this.isOpening = false
    this.tellProblem(error instanceof Error ? error.message : String(error))
  }

  /** The system took it away: another program, a call, a locked screen. */
  private lost(track: MediaStreamTrack): void {
    if (track !== this.track) return
    this.track = null
    this.tellProblem('The system has taken it away; it is tried again when this page is looked at.')
  }

  /** The system lets it run and gives nothing, as iOS does behind a locked screen: it may go on by itself. */
  private heldBack(track: MediaStreamTrack): void {
    this.changed(this.entry.label, track, HELD_BACK)
    for (const watcher of this.watchers) watcher.unavailable(HELD_BACK)
  }

  private tellProblem(problem: string): void {
    this.changed(this.entry.label, null, problem)
    for (const watcher of this.watchers) watcher.unavailable(problem)
  }

  private close(): void {
    const { track } = this
    this.opening += 1
    this.isOpening = false
    this.track = null
    if (track === null) return
    track.onended = track.onmute = track.onunmute = null
    track.stop()
    this.changed(this.entry.label, null, '')
  }
}

function give({ sender }: TrackWatcher, track: MediaStreamTrack | null): void {
  guarded(() => sender.replaceTrack(track))
}
