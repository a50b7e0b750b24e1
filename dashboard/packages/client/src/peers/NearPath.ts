import { Value, type Readable } from '../platform/Readable'

/** The path may still be changing when the robot speaks. */
const LOOK_AFTER_MS = [0, 5000]

/**
 * Finds out where the robot serves this page itself, for an operator whose connection goes to one of those addresses already: who
 * talks to the robot's own address can open it, too. No request is made to find out, for browsers forbid most of them.
 */
export class NearPath {
  private readonly urls = new Value<readonly string[]>([])
  private round = 0

  /** The one on the present path first; empty while it is not known to be reachable. */
  readonly value: Readable<readonly string[]> = this.urls

  /** `remoteAddress`: the robot's end of the connection now; null while unknown. */
  told(urls: readonly string[], remoteAddress: () => Promise<string | null>): void {
    const round = ++this.round
    for (const afterMs of LOOK_AFTER_MS) {
      setTimeout(() => void this.look(urls, remoteAddress, round), afterMs)
    }
  }

  /** The connection is gone, and with it what is known of its path. */
  forget(): void {
    this.round += 1
    if (this.urls.get().length > 0) this.urls.set([])
  }

  private async look(urls: readonly string[], remoteAddress: () => Promise<string | null>, round: number): Promise<void> {
    if (round !== this.round) return
    const address = await remoteAddress().catch(() => null)
    if (round === this.round && address !== null) this.urls.set(onPath(urls, address))
  }
}

/** The URLs, that of `address` first; none if the path leads elsewhere. */
export function onPath(urls: readonly string[], address: string): readonly string[] {
  const direct = urls.filter((url) => hostOf(url) === address.toLowerCase())
  // The path may have taken the robot's other address, IPv6 for example: a private one is on the same network, too.
  if (direct.length === 0 && !PRIVATE.test(address)) return []
  return [...direct, ...urls.filter((url) => !direct.includes(url))]
}

/** RFC 1918, and the unique local and link-local addresses of IPv6. */
const PRIVATE = /^(10\.|192\.168\.|172\.(1[6-9]|2\d|3[01])\.|f[cd][0-9a-f]{2}:|fe80:)/i

function hostOf(url: string): string | null {
  return URL.canParse(url) ? new URL(url).hostname.replace(/^\[|\]$/g, '').toLowerCase() : null
}
