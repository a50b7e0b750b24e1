import type { CatalogueEntry } from '@mosaic/protocol'
import type { Platform } from '@mosaic/client'
import { TalkFloor } from '../control/TalkFloor'
import { mediaEntry } from './catalogue'

const LOOK_PERIOD_MS = 100

/** What plays a voice: an `<audio>` element. */
export interface VoicePlayer {
  mute(isMuted: boolean): void
  end(): void
}

/** Whose voice it may be. */
export interface Speaker {
  readonly id: string
  /** False for whoever may only watch. */
  readonly mayTalk: boolean
  /** It is not heard, and why: somebody else talks, or it may not. */
  talkRefused(label: string, code: string): void
}

interface Voice {
  speaker: Speaker
  receiver: RTCRtpReceiver
  player: VoicePlayer
  packets: number
  isRefused: boolean
}

/** Plays operators' voices, one at a time, and notices by their packets who talks. */
export class Loudspeaker {
  readonly entry: CatalogueEntry = mediaEntry('loudspeaker', 'audio', 'to-robot')
  private readonly voices = new Map<string, Voice>()
  private readonly floor = new TalkFloor()
  private talker: string | null = null
  private endTicks: (() => void) | null = null

  /** `told` hears who talks, whenever that changes; `isSilenced`: a stop is in force. */
  constructor(
    private readonly platform: Pick<Platform, 'now' | 'ticks'>,
    private readonly play: (track: MediaStreamTrack) => VoicePlayer,
    private readonly told: (peerId: string | null) => void,
    private readonly isSilenced: () => boolean,
  ) {}

  /** Who talks now. */
  get talking(): string | null {
    return this.talker
  }

  add(speaker: Speaker, track: MediaStreamTrack, receiver: RTCRtpReceiver): void {
    this.remove(speaker.id)
    const player = this.play(track)
    player.mute(true)
    this.voices.set(speaker.id, { speaker, receiver, player, packets: 0, isRefused: false })
    this.endTicks ??= this.platform.ticks.every(LOOK_PERIOD_MS, () => void this.look())
  }

  remove(peerId: string): void {
    this.voices.get(peerId)?.player.end()
    this.voices.delete(peerId)
    this.floor.left(peerId)
    this.settle()
    if (this.voices.size > 0) return
    this.endTicks?.()
    this.endTicks = null
  }

  private async look(): Promise<void> {
    const voices = [...this.voices.values()]
    const counts = await Promise.all(voices.map(({ receiver }) => packetsOf(receiver)))
    voices.forEach((voice, index) => this.counted(voice, counts[index] ?? 0))
    this.settle()
  }

  private counted(voice: Voice, packets: number): void {
    const isTalking = packets > voice.packets
    voice.packets = packets
    if (!isTalking || this.voices.get(voice.speaker.id) !== voice) {
      voice.isRefused = false
      return
    }
    const { id, mayTalk } = voice.speaker
    const isHeard = mayTalk && this.floor.heard(id, this.platform.now())
    if (!isHeard && !voice.isRefused) voice.speaker.talkRefused(this.entry.label, mayTalk ? 'media.talk_busy' : 'lease.forbidden')
    voice.isRefused = !isHeard
  }

  private settle(): void {
    const talker = this.isSilenced() ? null : this.floor.talker(this.platform.now())
    for (const [peerId, { player }] of this.voices) player.mute(peerId !== talker)
    if (talker === this.talker) return
    this.talker = talker
    this.told(talker)
  }
}

async function packetsOf(receiver: RTCRtpReceiver): Promise<number> {
  let packets = 0
  // Its connection may be over meanwhile.
  const report = await receiver.getStats().catch(() => null)
  report?.forEach((row: { type?: string; packetsReceived?: number }) => {
    if (row.type === 'inbound-rtp') packets += row.packetsReceived ?? 0
  })
  return packets
}
