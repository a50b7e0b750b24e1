import { DeadlineTimer } from './DeadlineTimer'

/** Decides without a clock, a socket or a timer; `deadlinePassed` is among its events. */
export interface Machine<Event, Effect> {
  /** When it wants `deadlinePassed`; null: not at all. */
  readonly deadlineMs: number | null
  handle(event: Event | DeadlinePassed, nowMs: number): readonly Effect[]
}

export interface DeadlinePassed {
  type: 'deadlinePassed'
}

/** Does what a machine has decided. */
export interface MachineOwner<Effect> {
  carryOut(effect: Effect): void
  /** The machine's state is new; nothing has been carried out yet. */
  decided?(): void
  /** The deadline is noticed now, so much too late; the machine hears of it next. */
  woken?(lateMs: number): void
}

/**
 * Drives one pure machine: hands it events and the time, has its effects carried out, and keeps its deadline. Events that
 * are told while an effect is carried out are done with before the next effect.
 */
export class MachineDriver<Event, Effect> {
  private readonly timer: DeadlineTimer
  private isStopped = false

  constructor(
    private readonly machine: Machine<Event, Effect>,
    private readonly clock: { now(): number },
    private readonly owner: MachineOwner<Effect>,
  ) {
    this.timer = new DeadlineTimer(clock, (lateMs) => this.deadlinePassed(lateMs))
  }

  /** It happened, now. */
  tell(event: Event | DeadlinePassed): void {
    if (this.hasStopped()) return
    const effects = this.machine.handle(event, this.clock.now())
    this.owner.decided?.()
    for (const effect of effects) {
      this.owner.carryOut(effect)
      if (this.hasStopped()) return
    }
    this.timer.set(this.machine.deadlineMs)
  }

  /** For good, also from within an effect: no event is taken, no effect carried out, no deadline watched any more. */
  stop(): void {
    this.isStopped = true
    this.timer.set(null)
  }

  /** A method, as any effect may have changed the answer. */
  private hasStopped(): boolean {
    return this.isStopped
  }

  private deadlinePassed(lateMs: number): void {
    this.owner.woken?.(lateMs)
    this.tell({ type: 'deadlinePassed' })
  }
}
