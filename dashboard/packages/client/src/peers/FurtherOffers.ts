import type { ControlMessages } from '@mosaic/protocol'
import { Listeners } from '../platform/Readable'
import { DeadlineTimer } from '../timing/DeadlineTimer'
import type { MediaLine, PeerLink } from './PeerLink'

/** The robot answers within a moment, or not at all. */
const ANSWER_TIMEOUT_MS = 10_000

/** The way to the robot, while there is one. */
export interface OfferSignaling {
  send(type: 'renegotiate.offer', data: ControlMessages['renegotiate.offer']): boolean
}

/**
 * Offers media lines for connectors that became known after the first offer: over the control channel, while everything
 * else goes on. One offer at a time; a robot that refuses one, or says nothing, is not asked again on this connection.
 */
export class FurtherOffers {
  /** Null while there is none that takes further offers. */
  private link: PeerLink | null = null
  private attempt = 0
  private isBusy = false
  private isOver = false
  private readonly timer: DeadlineTimer

  /** Lines were added. */
  readonly added = new Listeners<[]>()

  constructor(
    private readonly clock: { now(): number },
    private readonly main: OfferSignaling,
  ) {
    this.timer = new DeadlineTimer(clock, () => this.giveUp('signal.timeout'))
  }

  /** The robot takes further offers on this connection. */
  greeted(link: PeerLink): void {
    this.link = link
  }

  /** These lines are wanted and not there. */
  want(lines: readonly MediaLine[]): void {
    if (this.link !== null && !this.isBusy && !this.isOver && lines.length > 0) void this.offer(this.link, lines)
  }

  /** The robot's answer. */
  heard({ attempt, sdp, code }: ControlMessages['renegotiate.answer']): void {
    if (this.link === null || this.isOver || !this.isBusy || attempt !== this.attempt) return
    if (sdp === undefined) return this.giveUp(code)
    void this.accept(this.link, sdp)
  }

  /** The connection is over; the next one begins anew. */
  close(): void {
    this.link = null
    this.attempt = 0
    this.isBusy = this.isOver = false
    this.timer.set(null)
  }

  private async offer(link: PeerLink, lines: readonly MediaLine[]): Promise<void> {
    this.isBusy = true
    this.attempt += 1
    const { attempt } = this
    try {
      const { sdp, tracks } = await link.offer(lines)
      if (this.link !== link) return
      const isSent = this.main.send('renegotiate.offer', { attempt, sdp, tracks })
      if (isSent) this.timer.set(this.clock.now() + ANSWER_TIMEOUT_MS)
      else this.giveUp('peer.lost')
    } catch (error) {
      if (this.link === link) this.giveUp(String(error))
    }
  }

  private async accept(link: PeerLink, sdp: string): Promise<void> {
    this.timer.set(null)
    try {
      await link.acceptMore(sdp)
    } catch (error) {
      if (this.link === link) this.giveUp(String(error))
    }
    if (this.isOver || this.link !== link) return
    this.isBusy = false
    this.added.tell()
  }

  private giveUp(why: string): void {
    this.isOver = true
    this.timer.set(null)
    console.warn(`mosaic: the connection keeps the media lines that it has (${why})`)
  }
}
