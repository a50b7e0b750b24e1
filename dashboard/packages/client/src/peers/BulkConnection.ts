import type { ControlMessage, ControlMessages, IceCandidate, IceServer } from '@mosaic/protocol'
import { BulkLink } from './BulkLink'
import { OperatorBulkMachine, type BulkEffect, type BulkEvent, type BulkPhase } from './bulkOfOperator'
import type { Platform } from '../platform/Platform'
import { Listeners, Value, type Readable } from '../platform/Readable'
import { MachineDriver } from '../timing/MachineDriver'
import { LocalCandidates } from './LocalCandidates'

type BulkWord = 'lane.offer' | 'lane.candidate' | 'lane.close'

/** Whether there is a second peer connection for bulk data; `code` says why it failed. */
export interface BulkLaneState {
  phase: BulkPhase
  code?: string
}

/** Where ICE servers come from; fresh ones, because their credentials live for minutes. */
export interface IceSource {
  freshIceServers(): Promise<readonly IceServer[]>
}

/** The way to the robot, while there is one. */
export interface BulkSignaling {
  send<T extends BulkWord>(type: T, data: ControlMessages[T]): boolean
}

/** A peer connection, as far as channels of connectors go. */
export type ChannelCarrier = Pick<BulkLink, 'openChannel'>

interface Attempt {
  number: number
  link: BulkLink
  /** They wait until the offer has left. */
  candidates: LocalCandidates
}

/**
 * Keeps the second peer connection of a robot connection, for connectors with delivery `bulk`: commands never wait behind
 * them. `OperatorBulkMachine` decides, this carries it out. It is signaled over the control channel, without the server.
 */
export class BulkConnection {
  private readonly status = new Value<BulkLaneState>({ phase: 'none' })
  private machine: OperatorBulkMachine
  private driver: MachineDriver<BulkEvent, BulkEffect>
  private attempt: Attempt | null = null
  private isKnown = false
  private hasGreeted = false

  readonly state: Readable<BulkLaneState> = this.status
  /** Bulk channels open elsewhere from now on; those on the link that is told are gone. */
  readonly changed = new Listeners<[lost: BulkLink | null]>()

  constructor(
    private readonly platform: Platform,
    private readonly main: BulkSignaling,
    private readonly ice: IceSource,
  ) {
    this.machine = this.newMachine()
    this.driver = this.newDriver()
  }

  /** The robot said hello: whether it knows bulk connections. */
  greeted(isKnown: boolean): void {
    this.isKnown = isKnown
    this.hasGreeted = true
    this.changed.tell(null)
  }

  /** Where a bulk channel opens that is wanted now; null: it shall wait, for the hello or until the connection is made. */
  carrier(main: ChannelCarrier): ChannelCarrier | null {
    if (this.isKnown) this.driver.tell({ type: 'wanted' })
    if (!this.hasGreeted || this.machine.state === 'connecting') return null
    return this.machine.state === 'up' ? (this.attempt?.link ?? main) : main
  }

  /** The robot's word about the bulk connection. */
  heard(message: ControlMessage): void {
    const { attempt } = this
    if (message.type === 'lane.close') {
      const { attempt: number, code } = message.data
      return this.driver.tell({ type: 'failed', attempt: number, code, isTold: true })
    }
    if (message.type !== 'lane.answer' && message.type !== 'lane.candidate') return
    if (attempt?.number !== message.data.attempt) return
    if (message.type === 'lane.answer') void this.accept(attempt, message.data.sdp)
    else {
      const { candidate, sdpMid, sdpMLineIndex } = message.data
      void attempt.link.addCandidate({ candidate, sdpMid, sdpMLineIndex })
    }
  }

  /** The main connection is over, and with it the one for bulk. */
  drop(): void {
    this.attempt?.link.close()
    this.attempt = null
    this.isKnown = this.hasGreeted = false
    this.driver.stop()
    this.machine = this.newMachine()
    this.driver = this.newDriver()
    this.publish()
  }

  private newMachine(): OperatorBulkMachine {
    return new OperatorBulkMachine(() => this.platform.random())
  }

  private newDriver(): MachineDriver<BulkEvent, BulkEffect> {
    return new MachineDriver<BulkEvent, BulkEffect>(this.machine, this.platform, {
      decided: () => this.publish(),
      carryOut: (effect) => this.carryOut(effect),
    })
  }

  private carryOut(effect: BulkEffect): void {
    if (effect.type === 'begin') void this.begin(effect.attempt)
    else if (effect.type === 'use') this.changed.tell(null)
    else if (effect.type === 'ping') this.attempt?.link.ping()
    else this.fallBack(effect)
  }

  private async begin(number: number): Promise<void> {
    // Every main connection has a machine of its own: what was begun for an older one is recognized by that.
    const { machine } = this
    const iceServers = await this.ice.freshIceServers()
    const isOver = (): boolean => machine !== this.machine || machine.state !== 'connecting'
    if (isOver() || this.attempt !== null) return
    try {
      const attempt = this.newAttempt(number, iceServers)
      this.attempt = attempt
      const sdp = await attempt.link.offer()
      if (isOver() || this.attempt !== attempt) return
      this.main.send('lane.offer', { lane: 'bulk', attempt: number, sdp })
      attempt.candidates.release()
    } catch {
      if (machine === this.machine) this.driver.tell({ type: 'failed', attempt: number, code: 'sdp.invalid' })
    }
  }

  private newAttempt(number: number, iceServers: readonly IceServer[]): Attempt {
    const send = (found: IceCandidate): void => void this.main.send('lane.candidate', { lane: 'bulk', attempt: number, ...found })
    const candidates = new LocalCandidates(send, { isHeld: true })
    const link = new BulkLink(this.platform, iceServers, {
      candidateFound: (candidate) => candidates.found(candidate),
      opened: () => this.driver.tell({ type: 'opened', attempt: number }),
      heard: () => this.driver.tell({ type: 'heard', attempt: number }),
      broken: (code) => this.driver.tell({ type: 'failed', attempt: number, code }),
    })
    return { number, link, candidates }
  }

  private async accept(attempt: Attempt, sdp: string): Promise<void> {
    try {
      await attempt.link.accept(sdp)
    } catch {
      // Numbers begin anew with every main connection: one of before must not be taken for one of now.
      if (this.attempt === attempt) this.driver.tell({ type: 'failed', attempt: attempt.number, code: 'sdp.invalid' })
    }
  }

  private fallBack({ attempt, code, tellsRobot }: BulkEffect & { type: 'fallBack' }): void {
    const lost = this.attempt?.link ?? null
    this.attempt = null
    if (tellsRobot) this.main.send('lane.close', { lane: 'bulk', attempt, code })
    lost?.close()
    this.changed.tell(lost)
  }

  private publish(): void {
    const { state: phase, code } = this.machine
    const now = this.status.get()
    if (now.phase !== phase || (now.code ?? '') !== code) this.status.set(code === '' ? { phase } : { phase, code })
  }
}
