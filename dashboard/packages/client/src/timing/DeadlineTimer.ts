/** The one timer of a machine that says when it wants to be woken. `woken` hears how late that was. */
export class WakeTimer {
  private timer: ReturnType<typeof setTimeout> | null = null

  constructor(
    private readonly now: () => number,
    private readonly woken: (lateMs: number) => void,
  ) {}

  /** Wake at this moment of `now`, and at no other; null: never. */
  set(atMs: number | null): void {
    if (this.timer !== null) clearTimeout(this.timer)
    this.timer = null
    if (atMs === null) return
    this.timer = setTimeout(() => this.woken(this.now() - atMs), Math.max(0, atMs - this.now()))
  }
}
