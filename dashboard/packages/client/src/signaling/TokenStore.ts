import type { Platform } from '../platform/Platform'

const KEY = 'mosaic.accessToken'

/** Keeps the access token: in memory, and in the browser's storage where that is allowed. */
export class TokenStore {
  private token: string | null

  constructor(private readonly platform: Platform) {
    this.token = platform.sessionStorage?.getItem(KEY) ?? platform.localStorage?.getItem(KEY) ?? null
  }

  get(): string | null {
    return this.token
  }

  /** With `remember` for all tabs and days, else for this tab. */
  set(token: string, remember: boolean): void {
    this.clear()
    this.token = token
    const storage = remember ? this.platform.localStorage : this.platform.sessionStorage
    storage?.setItem(KEY, token)
  }

  clear(): void {
    this.token = null
    this.platform.sessionStorage?.removeItem(KEY)
    this.platform.localStorage?.removeItem(KEY)
  }
}
