import { nowMs } from '../timing/clock'
import type { Platform } from './Platform'
import { pageTicks } from '../timing/Ticks'

/** The browser this page runs in. */
export function browserPlatform(): Platform {
  return {
    now: nowMs,
    random: () => Math.random(),
    ticks: pageTicks,
    fetch: (input, init) => globalThis.fetch(input, init),
    openWebSocket: (url) => new WebSocket(url),
    openPeerConnection: (configuration) => new RTCPeerConnection(configuration),
    newMediaStream: (track) => new MediaStream([track]),
    localStorage: storageOrNull(() => globalThis.localStorage),
    sessionStorage: storageOrNull(() => globalThis.sessionStorage),
    isVisible: () => document.visibilityState !== 'hidden',
    onVisibilityChange: (listener) => document.addEventListener('visibilitychange', listener),
    onPageHide: (listener) => window.addEventListener('pagehide', listener),
    standStill: (ms) => {
      // The browser sends on threads of its own; nothing else keeps a page that is being left.
      for (const untilMs = performance.now() + ms; performance.now() < untilMs; );
    },
    onPageShow: (listener) => window.addEventListener('pageshow', listener),
    onNetworkChange: (listener) => {
      window.addEventListener('online', listener)
      window.addEventListener('offline', listener)
      connectionOf(navigator)?.addEventListener('change', listener)
    },
  }
}

// Only Chromium knows it.
function connectionOf(navigator: object): EventTarget | null {
  return 'connection' in navigator && navigator.connection instanceof EventTarget ? navigator.connection : null
}

// Reading the property alone throws where the user forbids storage.
function storageOrNull(read: () => Storage): Storage | null {
  try {
    return read()
  } catch {
    return null
  }
}
