/**
 * Talking while a button is held, without React. The microphone is asked for when it is pressed and given back when it is
 * released, so that the browser's sign for it tells the truth. Whatever happens to the page ends the talk.
 */
import { Value, type Readable } from '@mosaic/client'
import { microphoneProblem, NO_SECURE_CONTEXT } from './microphoneProblem'

export type TalkPhase = 'silent' | 'asking' | 'talking'

export interface TalkSurroundings {
  /** Undefined where the page has no secure context. */
  getUserMedia: ((constraints: MediaStreamConstraints) => Promise<MediaStream>) | undefined
  setTrack: (track: MediaStreamTrack | null) => Promise<boolean>
  page: Pick<Window, 'addEventListener' | 'removeEventListener'>
  document: Pick<Document, 'addEventListener' | 'removeEventListener' | 'visibilityState'>
}

const CONSTRAINTS: MediaStreamConstraints = {
  audio: { echoCancellation: true, noiseSuppression: true, autoGainControl: true },
}

export class TalkSession {
  private readonly status = new Value<TalkPhase>('silent')
  private readonly trouble = new Value('')
  private stream: MediaStream | null = null
  /** Counts presses, so that a microphone that comes after its release is given back. */
  private press = 0

  readonly phase: Readable<TalkPhase> = this.status
  /** Why nothing was said at the last press; empty: nothing is wrong. */
  readonly problem: Readable<string> = this.trouble

  constructor(private readonly around: TalkSurroundings) {
    around.page.addEventListener('blur', this.end)
    around.document.addEventListener('visibilitychange', this.hidden)
  }

  begin(): void {
    if (this.status.get() !== 'silent') return
    this.trouble.set('')
    const { getUserMedia } = this.around
    if (getUserMedia === undefined) {
      this.trouble.set(NO_SECURE_CONTEXT)
      return
    }
    this.status.set('asking')
    void this.open(getUserMedia, ++this.press)
  }

  readonly end = (): void => {
    this.press += 1
    const wasTalking = this.status.get() === 'talking'
    this.status.set('silent')
    stopTracks(this.stream)
    this.stream = null
    if (wasTalking) void this.around.setTrack(null).catch(() => {})
  }

  dispose(): void {
    this.around.page.removeEventListener('blur', this.end)
    this.around.document.removeEventListener('visibilitychange', this.hidden)
    this.end()
  }

  private async open(getUserMedia: (constraints: MediaStreamConstraints) => Promise<MediaStream>, press: number) {
    try {
      const stream = await getUserMedia(CONSTRAINTS)
      if (press !== this.press) {
        stopTracks(stream)
        return
      }
      this.stream = stream
      const [track] = stream.getAudioTracks()
      if (track === undefined) throw new DOMException('', 'NotFoundError')
      track.addEventListener('ended', this.end)
      this.status.set('talking')
      if (!(await this.around.setTrack(track)) && press === this.press) this.fail('Not connected to the robot.')
    } catch (error) {
      if (press === this.press) this.fail(microphoneProblem(error))
    }
  }

  private fail(problem: string): void {
    this.end()
    this.trouble.set(problem)
  }

  private readonly hidden = (): void => {
    if (this.around.document.visibilityState === 'hidden') this.end()
  }
}

function stopTracks(stream: MediaStream | null): void {
  for (const track of stream?.getTracks() ?? []) track.stop()
}
