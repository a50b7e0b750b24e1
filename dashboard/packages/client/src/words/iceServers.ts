/**
 * Which of the server's ICE servers a browser takes. It makes no peer connection at all if one of them is wrong, so
 * that one is left out here, and named by the connection check.
 */
import type { IceServer, ReasonCode } from '@mosaic/protocol'

export interface UnusableIceServer {
  url: string
  code: ReasonCode & ('ice.turn_no_credentials' | 'ice.bad_url')
  problem: string
}

export interface SortedIceServers {
  /** One URL each. */
  usable: RTCIceServer[]
  unusable: UnusableIceServer[]
}

/** RFC 7064 and 7065: a host, an IPv6 address in brackets, and for TURN the transport. */
const HOST = String.raw`(\[[0-9a-f:.]+\]|[^\s/?#:@[\]]+)`
const FORM = new RegExp(String.raw`^(stuns?|turns?):${HOST}(:(?<port>\d{1,5}))?(?<transport>\?transport=(udp|tcp))?$`, 'i')

export function sortedIceServers(servers: readonly IceServer[]): SortedIceServers {
  const sorted: SortedIceServers = { usable: [], unusable: [] }
  for (const { urls, username, credential } of servers) {
    for (const url of urls.map(withScheme)) {
      if (!isWellFormed(url)) sorted.unusable.push({ url, code: 'ice.bad_url', problem: 'that is no address of an ICE server' })
      else if (!isTurn(url)) sorted.usable.push({ urls: [url] })
      // Empty ones are refused like missing ones.
      else if (username && credential) sorted.usable.push({ urls: [url], username, credential })
      else sorted.unusable.push({ url, code: 'ice.turn_no_credentials', problem: 'user name or password is missing' })
    }
  }
  return sorted
}

export function usableIceServers(servers: readonly IceServer[]): RTCIceServer[] {
  return sortedIceServers(servers).usable
}

export function isTurn(url: string): boolean {
  return /^turns?:/i.test(url)
}

function isWellFormed(url: string): boolean {
  const parts = FORM.exec(url)?.groups
  if (parts === undefined) return false
  const port = Number(parts['port'] ?? 1)
  return port > 0 && port < 65_536 && (isTurn(url) || parts['transport'] === undefined)
}

// Original configurations write `host:port` and mean TURN.
function withScheme(url: string): string {
  return /^(stuns?|turns?):/i.test(url) ? url : `turn:${url}`
}
