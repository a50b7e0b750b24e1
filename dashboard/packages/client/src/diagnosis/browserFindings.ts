/** What this browser can do for operating a robot. */
import type { Finding } from '@mosaic/protocol'
import { failed, passed, warned } from './findings'

export interface Abilities {
  hasWebRtc: boolean
  isSecure: boolean
  /** `granted`, `denied`, `prompt`; null where the browser does not tell. */
  microphone: string | null
  hasGamepads: boolean
  /** MIME types of the video codecs that can be received. */
  videoCodecs: readonly string[]
  hasVideoDecoder: boolean
}

const NEEDED_CODECS = ['video/VP8', 'video/H264']

/** What is there; reads only. */
export async function readAbilities(): Promise<Abilities> {
  return {
    hasWebRtc: typeof RTCPeerConnection !== 'undefined',
    isSecure: globalThis.isSecureContext,
    microphone: await microphonePermission(),
    hasGamepads: typeof navigator.getGamepads === 'function',
    videoCodecs: videoCodecs(),
    hasVideoDecoder: typeof VideoDecoder !== 'undefined',
  }
}

export function browserFindings(can: Abilities): Finding[] {
  const missing = NEEDED_CODECS.filter((codec) => !can.videoCodecs.includes(codec))
  const codecs = can.videoCodecs.map((codec) => codec.replace('video/', '')).join(', ')
  return [
    can.hasWebRtc ? passed('browser.webrtc', 'This browser has WebRTC.') : failed('browser.webrtc', 'check.no_webrtc'),
    can.isSecure ? passed('browser.secure', 'The page is a secure one (https, or localhost).') : warned('browser.secure', 'check.insecure_page'),
    ...(can.hasWebRtc ? [decoders(missing, codecs)] : []),
    microphoneFinding(can),
    can.hasGamepads
      ? passed('browser.gamepad', 'Gamepads can be used: press a button of one to show it.')
      : warned('browser.gamepad', 'check.no_gamepad'),
  ]
}

function decoders(missing: readonly string[], codecs: string): Finding {
  if (missing.length === 0) return passed('browser.decoders', `Video codecs: ${codecs}.`)
  const names = missing.map((codec) => codec.replace('video/', '')).join(' and ')
  const facts = { missing }
  // A robot encodes in either: one of them is enough.
  if (missing.length < NEEDED_CODECS.length) {
    return warned('browser.decoders', 'check.no_decoder', { sentence: `This browser does not decode ${names}.`, facts })
  }
  return failed('browser.decoders', 'check.no_decoder', { facts })
}

function microphoneFinding({ microphone, isSecure }: Abilities): Finding {
  if (!isSecure || microphone === 'denied') return warned('browser.microphone', 'check.no_microphone')
  const ask = 'The browser will ask before the microphone is used.'
  return passed('browser.microphone', microphone === 'granted' ? 'The microphone may be used.' : ask)
}

async function microphonePermission(): Promise<string | null> {
  try {
    return (await navigator.permissions.query({ name: 'microphone' })).state
  } catch {
    return null
  }
}

function videoCodecs(): string[] {
  if (typeof RTCRtpReceiver === 'undefined') return []
  const found = RTCRtpReceiver.getCapabilities('video')?.codecs.map(({ mimeType }) => mimeType) ?? []
  const helpers = new Set(['video/rtx', 'video/red', 'video/ulpfec', 'video/flexfec-03'])
  return [...new Set(found)].filter((codec) => !helpers.has(codec))
}
