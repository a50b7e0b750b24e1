/** Words may have pauses of this length. */
const PAUSE_MS = 500

/** Decides whose voice a loudspeaker plays, purely: that of the first who talks, until they are silent or gone. */
export class TalkFloor {
  private held: { peerId: string; untilMs: number } | null = null

  /** The peer's voice is heard now; false while somebody else talks. */
  heard(peerId: string, nowMs: number): boolean {
    if (this.talker(nowMs) !== null && this.held?.peerId !== peerId) return false
    this.held = { peerId, untilMs: nowMs + PAUSE_MS }
    return true
  }

  left(peerId: string): void {
    if (this.held?.peerId === peerId) this.held = null
  }

  /** Who talks now. */
  talker(nowMs: number): string | null {
    if (this.held !== null && nowMs >= this.held.untilMs) this.held = null
    return this.held?.peerId ?? null
  }
}
