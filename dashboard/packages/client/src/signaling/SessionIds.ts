import type { Platform } from '../platform/Platform'

const KEY = 'mosaic.sessionIds'

/**
 * Remembers this tab's session id per robot: lease and resumption hang on it, so it survives a reload. While the page is shown
 * the ids live in memory only: a duplicated tab copies the session storage, and must not copy the session.
 */
export class SessionIds {
  private readonly ids: Map<string, string>

  constructor(private readonly platform: Platform) {
    this.ids = this.takeOut()
    platform.onPageHide(() => this.putBack())
    platform.onPageShow(() => this.platform.sessionStorage?.removeItem(KEY))
  }

  of(robotId: string): string | undefined {
    return this.ids.get(robotId)
  }

  remember(robotId: string, sessionId: string): void {
    this.ids.set(robotId, sessionId)
  }

  /** Somebody else signs in, or nobody. */
  forgetAll(): void {
    this.ids.clear()
  }

  private takeOut(): Map<string, string> {
    const stored = this.platform.sessionStorage?.getItem(KEY) ?? '{}'
    this.platform.sessionStorage?.removeItem(KEY)
    try {
      const ids = Object.entries(JSON.parse(stored) as object)
      return new Map(ids.filter((entry): entry is [string, string] => typeof entry[1] === 'string'))
    } catch {
      return new Map()
    }
  }

  private putBack(): void {
    this.platform.sessionStorage?.setItem(KEY, JSON.stringify(Object.fromEntries(this.ids)))
  }
}
