/** Calls back once at a deadline that can be moved as often as wanted; `passed` hears how late that is. */
export class DeadlineTimer {
  private timer: ReturnType<typeof setTimeout> | null = null

  constructor(
    private readonly clock: { now(): number },
    private readonly passed: (lateMs: number) => void,
  ) {}

  /** Call back at this moment of the clock, and at no other; null: never. */
  set(deadlineMs: number | null): void {
    if (this.timer !== null) clearTimeout(this.timer)
    this.timer = null
    if (deadlineMs === null) return
    const passed = (): void => this.passed(this.clock.now() - deadlineMs)
    this.timer = setTimeout(passed, Math.max(0, deadlineMs - this.clock.now()))
  }
}
