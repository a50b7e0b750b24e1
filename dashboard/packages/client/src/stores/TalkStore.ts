import type { Refusal } from '@mosaic/protocol'
import { Value, type Readable } from '../platform/Readable'
import { MosaicStore, type StoreType } from './MosaicStore'

/** What a connection lends a talk store: the line to the loudspeaker (an `RTCRtpSender`). */
export interface VoiceLine {
  replaceTrack(track: MediaStreamTrack | null): Promise<void>
}

/** Whose voice the loudspeaker plays. */
export interface Talker {
  peerId: string
  name: string
}

/**
 * Sends one's own voice to a loudspeaker of the robot, one operator at a time. Nothing is sent before
 * `setTrack`. When the connection ends the track is let go: a connection that comes back begins in silence.
 */
export class TalkStore extends MosaicStore {
  private readonly heard = new Value<Talker | null>(null)
  private readonly refusal = new Value<Refusal | null>(null)
  private line: VoiceLine | null = null

  /** Who is heard now; null: nobody. */
  readonly talker: Readable<Talker | null> = this.heard
  /** The last time that the robot did not take this page's voice: `media.talk_busy` while somebody else talks. */
  readonly lastRefusal: Readable<Refusal | null> = this.refusal

  getStoreType(): StoreType {
    return 'media'
  }

  /** Talk with this track of a microphone, or (null) be silent at once; false while there is no line. */
  async setTrack(track: MediaStreamTrack | null): Promise<boolean> {
    const { line } = this
    if (line === null) return false
    if (track !== null) this.refusal.set(null)
    await line.replaceTrack(track)
    return line === this.line
  }

  /** Called by the connection; null when it is gone. False: it is the line that it had. */
  connectLine(line: VoiceLine | null): boolean {
    const isNew = line !== this.line
    this.line = line
    if (line === null) {
      this.heard.set(null)
      this.refusal.set(null)
    }
    return isNew
  }

  /** Called by the connection. */
  talkingChanged(talker: Talker | null): void {
    this.heard.set(talker)
  }

  /** Called by the connection. */
  refused(refusal: Refusal): void {
    this.refusal.set(refusal)
  }
}
