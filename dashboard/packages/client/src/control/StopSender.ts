import { STOP_REPEAT_MS, type Stop, type StopAck } from '@mosaic/protocol'
import { randomId } from '../platform/randomId'
import type { Platform } from '../platform/Platform'
import { Value, type Readable } from '../platform/Readable'
import { StopCourse } from './StopCourse'
import type { StopReport, ZerosReport } from '../words/views'

/** The ways of a stop to the robot, while there are any. */
export interface StopLink {
  /** Whether a connection is there or on its way. */
  readonly isComing: boolean
  /** On the stop channel; false while that isn't open. */
  sendStop(stop: Stop): boolean
  /** On the control channel, for a path or robot without a stop channel. */
  send(type: 'stop', stop: Stop): boolean
  /** A moment of the robot's clock on this page's; null while they have not been compared. */
  toPageMs(robotUs: number): number | null
}

/** Says stop until the robot has heard it: at once on both channels, then on the stop channel at a steady pace. */
export class StopSender {
  private readonly last = new Value<StopReport | null>(null)
  private course: StopCourse | null = null
  private outcome: { promise: Promise<StopReport>; resolve: (report: StopReport) => void } | null = null
  private endTicks: (() => void) | null = null

  /** My last stop. */
  readonly report: Readable<StopReport | null> = this.last

  constructor(
    private readonly platform: Pick<Platform, 'now' | 'ticks'>,
    private readonly link: StopLink,
  ) {}

  /** Say stop; while one is being said this adds a copy to it. `zeros`: a robot that knows none was sent these instead. */
  say(reason: string, zeros: ZerosReport | null): Promise<StopReport> {
    const now = this.platform.now()
    const isNew = this.course === null || this.outcome === null
    const course = isNew ? new StopCourse(randomId(), reason, now) : this.course
    this.course = course
    const { promise } = (this.outcome ??= resolvable())
    this.send(true)
    if (zeros !== null) this.abandon('unavailable', zeros)
    else if (!this.link.isComing) this.abandon('unconfirmed')
    else if (this.course === course) this.endTicks ??= this.platform.ticks.every(STOP_REPEAT_MS, () => this.tick())
    this.publish()
    return promise
  }

  acknowledged(ack: StopAck): void {
    this.course?.acknowledged(ack, this.platform.now(), (robotUs) => this.link.toPageMs(robotUs))
    this.publish()
  }

  /** There is a new link: what was said on the old one counts for nothing. */
  linkUp(): void {
    if (this.course !== null && !this.course.isAcknowledged) this.send(true)
    this.publish()
  }

  /** True while it waits for the robot's answer. */
  get isSaying(): boolean {
    return this.course !== null && !this.course.isAcknowledged
  }

  /** Nobody will hear it any more. */
  abandon(phase: 'unconfirmed' | 'unavailable', zeros?: ZerosReport): void {
    this.course?.abandoned(phase, zeros)
    this.publish()
  }

  private tick(): void {
    if (this.course?.isDue(this.platform.now())) this.send(false)
    this.publish()
  }

  private send(onBoth: boolean): void {
    const { course } = this
    if (course === null) return
    const { id, reason } = course.report
    const isSent = this.link.sendStop({ id, reason })
    const isSaid = onBoth && this.link.send('stop', { id, reason })
    if (isSent || isSaid) course.sent(this.platform.now())
  }

  private publish(): void {
    const { course } = this
    if (course === null) return
    this.last.set(course.report)
    if (!course.isOver(this.platform.now())) return
    this.endTicks?.()
    this.endTicks = this.course = null
    this.outcome?.resolve(course.report)
    this.outcome = null
  }
}

function resolvable(): { promise: Promise<StopReport>; resolve: (report: StopReport) => void } {
  let resolve: (report: StopReport) => void = () => {}
  const promise = new Promise<StopReport>((settle) => (resolve = settle))
  return { promise, resolve }
}
