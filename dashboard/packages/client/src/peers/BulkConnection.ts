import type { ControlMessage, ControlMessages, IceCandidate, IceServer } from '@mosaic/protocol'
import { BulkLink } from './BulkLink'
import { OperatorBulkMachine, type LaneEffect, type LaneEvent, type LaneState } from './bulkOfOperator'
import type { Platform } from '../platform/Platform'
import { Value, type Readable } from '../platform/Readable'
import { WakeTimer } from '../timing/WakeTimer'

type LaneWord = 'lane.offer' | 'lane.candidate' | 'lane.close'

/** Whether there is a second peer connection for bulk data; `code` says why it failed. */
export interface BulkLaneState {
  phase: LaneState
  code?: string
}

export interface LaneHost {
  /** Fresh ones: their credentials live for minutes. */
  iceServers(): Promise<readonly IceServer[]>
  send<T extends LaneWord>(type: T, data: ControlMessages[T]): boolean
  /** Bulk channels open elsewhere from now on; those on the link `lost` are gone. */
  changed(lost: BulkLink | null): void
}

interface Attempt {
  number: number
  link: BulkLink
  /** Candidates wait until the offer has left; null: it has. */
  held: IceCandidate[] | null
}

/**
 * The second peer connection of one robot connection, for connectors with delivery `bulk`: commands never wait behind
 * them. `OperatorBulkMachine` decides, this carries it out. It is signaled over the control channel, without the server.
 */
export class BulkConnection {
  private readonly status = new Value<BulkLaneState>({ phase: 'none' })
  private session = new OperatorBulkMachine()
  private attempt: Attempt | null = null
  private readonly timer: WakeTimer
  private isKnown = false
  private hasGreeted = false
  /** Counts main connections, so that what was begun for an older one is recognized. */
  private generation = 0

  readonly state: Readable<BulkLaneState> = this.status

  constructor(
    private readonly platform: Platform,
    private readonly host: LaneHost,
  ) {
    this.timer = new WakeTimer(() => platform.now(), () => this.handle({ type: 'ticked' }))
  }

  /** Where bulk channels open; null: on the main connection. */
  get link(): BulkLink | null {
    return this.session.state === 'up' ? (this.attempt?.link ?? null) : null
  }

  /** The robot said hello: whether it knows lanes. */
  greeted(isKnown: boolean): void {
    this.isKnown = isKnown
    this.hasGreeted = true
    this.host.changed(null)
  }

  /** A bulk channel is wanted: false while it should wait, for the hello or because the lane is being made. */
  settled(): boolean {
    if (this.isKnown) this.handle({ type: 'wanted' })
    return this.hasGreeted && this.session.state !== 'connecting'
  }

  /** The robot's word about the lane. */
  heard(message: ControlMessage): void {
    const { attempt } = this
    if (message.type === 'lane.close') {
      const { attempt: number, code } = message.data
      return this.handle({ type: 'failed', attempt: number, code, isTold: true })
    }
    if (message.type !== 'lane.answer' && message.type !== 'lane.candidate') return
    if (attempt?.number !== message.data.attempt) return
    if (message.type === 'lane.answer') void this.accept(attempt, message.data.sdp)
    else {
      const { candidate, sdpMid, sdpMLineIndex } = message.data
      void attempt.link.addCandidate({ candidate, sdpMid, sdpMLineIndex })
    }
  }

  /** The main connection is over, and with it the lane. */
  drop(): void {
    this.generation += 1
    this.attempt?.link.close()
    this.attempt = null
    this.isKnown = this.hasGreeted = false
    this.session = new OperatorBulkMachine()
    this.publish()
    this.timer.set(this.session.wakeAtMs)
  }

  private handle(event: LaneEvent): void {
    const effects = this.session.handle(event, this.platform.now(), this.platform.random())
    this.publish()
    for (const effect of effects) this.carryOut(effect)
    this.timer.set(this.session.wakeAtMs)
  }

  private carryOut(effect: LaneEffect): void {
    if (effect.type === 'begin') void this.begin(effect.attempt)
    else if (effect.type === 'use') this.host.changed(null)
    else if (effect.type === 'ping') this.attempt?.link.ping()
    else this.fallBack(effect)
  }

  private async begin(number: number): Promise<void> {
    const { generation } = this
    const iceServers = await this.host.iceServers()
    const isOver = (): boolean => generation !== this.generation || this.session.state !== 'connecting'
    if (isOver() || this.attempt !== null) return
    try {
      const attempt = this.newAttempt(number, iceServers)
      this.attempt = attempt
      const sdp = await attempt.link.offer()
      if (isOver() || this.attempt !== attempt) return
      this.host.send('lane.offer', { lane: 'bulk', attempt: number, sdp })
      const held = attempt.held ?? []
      attempt.held = null
      for (const candidate of held) this.candidateFound(attempt, candidate)
    } catch {
      if (generation === this.generation) this.handle({ type: 'failed', attempt: number, code: 'sdp.invalid' })
    }
  }

  private newAttempt(number: number, iceServers: readonly IceServer[]): Attempt {
    const attempt: Attempt = {
      number,
      held: [],
      link: new BulkLink(this.platform, iceServers, {
        candidateFound: (candidate) => this.candidateFound(attempt, candidate),
        opened: () => this.handle({ type: 'opened', attempt: number }),
        heard: () => this.handle({ type: 'heard', attempt: number }),
        broken: (code) => this.handle({ type: 'failed', attempt: number, code }),
      }),
    }
    return attempt
  }

  private candidateFound(attempt: Attempt, candidate: IceCandidate): void {
    if (this.attempt !== attempt) return
    if (attempt.held) attempt.held.push(candidate)
    else this.host.send('lane.candidate', { lane: 'bulk', attempt: attempt.number, ...candidate })
  }

  private async accept(attempt: Attempt, sdp: string): Promise<void> {
    try {
      await attempt.link.accept(sdp)
    } catch {
      // Numbers begin anew with every main connection: one of before must not be taken for one of now.
      if (this.attempt === attempt) this.handle({ type: 'failed', attempt: attempt.number, code: 'sdp.invalid' })
    }
  }

  private fallBack({ attempt, code, tellsRobot }: LaneEffect & { type: 'fallBack' }): void {
    const lost = this.attempt?.link ?? null
    this.attempt = null
    if (tellsRobot) this.host.send('lane.close', { lane: 'bulk', attempt, code })
    lost?.close()
    this.host.changed(lost)
  }

  private publish(): void {
    const { state: phase, code } = this.session
    const now = this.status.get()
    if (now.phase !== phase || (now.code ?? '') !== code) this.status.set(code === '' ? { phase } : { phase, code })
  }
}
