import { MosaicClient, timerTicks, type Platform } from '@mosaic/client'

const never = (): never => {
  throw new Error('no network in this test')
}

const nothing = (): void => {}

/** A client in a browser without a network: what it hears a test tells its parts. */
export function offlineClient(): MosaicClient {
  const platform: Platform = {
    now: () => performance.now(),
    random: () => 0,
    ticks: timerTicks,
    fetch: () => Promise.reject(new Error('no network in this test')),
    openWebSocket: never,
    openPeerConnection: never,
    newMediaStream: never,
    localStorage: null,
    sessionStorage: null,
    isVisible: () => true,
    onVisibilityChange: nothing,
    onPageHide: nothing,
    standStill: nothing,
    onPageShow: nothing,
    onNetworkChange: nothing,
  }
  return new MosaicClient({ baseUrl: 'https://mosaic.example.org', platform })
}
