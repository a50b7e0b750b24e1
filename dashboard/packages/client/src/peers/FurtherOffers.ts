import type { ControlMessages } from '@mosaic/protocol'
import type { MediaLine, PeerLink } from './PeerLink'

/** The robot answers within a moment, or not at all. */
const ANSWER_TIMEOUT_MS = 10_000

export interface MoreLinesHost {
  send(data: ControlMessages['renegotiate.offer']): boolean
  /** The lines that are wanted and not there; none: nothing is missing. */
  missing(): readonly MediaLine[]
  /** Lines were added. */
  added(): void
}

/**
 * Media lines for connectors that became known after the first offer: offered over the control channel, while everything
 * else goes on. One offer at a time; a robot that refuses one, or says nothing, is not asked again on this connection.
 */
export class FurtherOffers {
  private attempt = 0
  private isBusy = false
  private isOver = false
  private timer: ReturnType<typeof setTimeout> | null = null

  constructor(
    private readonly link: PeerLink,
    private readonly host: MoreLinesHost,
  ) {}

  /** Something may be missing. */
  look(): void {
    if (this.isBusy || this.isOver) return
    const lines = this.host.missing()
    if (lines.length > 0) void this.offer(lines)
  }

  /** The robot's answer. */
  heard({ attempt, sdp, code }: ControlMessages['renegotiate.answer']): void {
    if (this.isOver || !this.isBusy || attempt !== this.attempt) return
    if (sdp === undefined) return this.giveUp(code)
    void this.accept(sdp)
  }

  /** The connection is over. */
  close(): void {
    this.isOver = true
    this.disarm()
  }

  private async offer(lines: readonly MediaLine[]): Promise<void> {
    this.isBusy = true
    this.attempt += 1
    const { attempt } = this
    try {
      const { sdp, tracks } = await this.link.offer(lines)
      if (this.isOver) return
      const isSent = this.host.send({ attempt, sdp, tracks })
      if (isSent) this.timer = setTimeout(() => this.giveUp('signal.timeout'), ANSWER_TIMEOUT_MS)
      else this.giveUp('peer.lost')
    } catch (error) {
      this.giveUp(String(error))
    }
  }

  private async accept(sdp: string): Promise<void> {
    this.disarm()
    try {
      await this.link.acceptMore(sdp)
      this.isBusy = false
    } catch (error) {
      this.giveUp(String(error))
    }
    if (this.isOver) return
    this.host.added()
    this.look()
  }

  private giveUp(why: string): void {
    this.close()
    console.warn(`mosaic: the connection keeps the media lines that it has (${why})`)
  }

  private disarm(): void {
    if (this.timer !== null) clearTimeout(this.timer)
    this.timer = null
  }
}
