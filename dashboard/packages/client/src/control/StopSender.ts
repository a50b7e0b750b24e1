import { STOP_REPEAT_MS, type Stop, type StopAck } from '@mosaic/protocol'
import { randomId } from '../platform/randomId'
import { Value, type Readable } from '../platform/Readable'
import { StopCourse } from './StopCourse'
import type { StopReport, ZerosReport } from '../words/views'

export interface StopSurroundings {
  readonly now: () => number
  readonly every: (periodMs: number, onTick: () => void) => () => void
  /** On the lane of its own; false while that isn't open. */
  readonly sendStop: (stop: Stop) => boolean
  /** One copy on the control channel, for a path or robot without that lane. */
  readonly sendOnControl: (stop: Stop) => boolean
  readonly toPageMs: (robotUs: number) => number | null
  /** Whether a connection is there or on its way. */
  readonly isComing: () => boolean
}

/** Says stop until the robot has heard it: at once on both channels, then on the stop lane at a steady pace. */
export class StopSender {
  private readonly last = new Value<StopReport | null>(null)
  private course: StopCourse | null = null
  private outcome: { promise: Promise<StopReport>; resolve: (report: StopReport) => void } | null = null
  private endTicks: (() => void) | null = null

  /** My last stop. */
  readonly report: Readable<StopReport | null> = this.last

  constructor(private readonly around: StopSurroundings) {}

  /** Say stop; while one is being said this adds a copy to it. `zeros`: a robot that knows none was sent these instead. */
  say(reason: string, zeros: ZerosReport | null): Promise<StopReport> {
    const now = this.around.now()
    const isNew = this.course === null || this.outcome === null
    const course = isNew ? new StopCourse(randomId(), reason, now) : this.course
    this.course = course
    const { promise } = (this.outcome ??= resolvable())
    this.send(true)
    if (zeros !== null) this.abandon('unavailable', zeros)
    else if (!this.around.isComing()) this.abandon('unconfirmed')
    else if (this.course === course) this.endTicks ??= this.around.every(STOP_REPEAT_MS, () => this.tick())
    this.publish()
    return promise
  }

  acknowledged(ack: StopAck): void {
    this.course?.acknowledged(ack, this.around.now(), (robotUs) => this.around.toPageMs(robotUs))
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
    if (this.course?.isDue(this.around.now())) this.send(false)
    this.publish()
  }

  private send(onBoth: boolean): void {
    const { course } = this
    if (course === null) return
    const { id, reason } = course.report
    const isSent = this.around.sendStop({ id, reason })
    const isSaid = onBoth && this.around.sendOnControl({ id, reason })
    if (isSent || isSaid) course.sent(this.around.now())
  }

  private publish(): void {
    const { course } = this
    if (course === null) return
    this.last.set(course.report)
    if (!course.isOver(this.around.now())) return
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
