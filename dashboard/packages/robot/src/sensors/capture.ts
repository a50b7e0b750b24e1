/** The camera and the microphone of this device, as connectors. */
import { mediaEntry } from '../connectors/catalogue'
import type { TrackConnector } from '../connectors/Connector'

export type Facing = 'environment' | 'user'

/** How a camera films. */
export interface CameraChoice {
  facing: Facing
  /** Lines of a picture that lies; a phone that stands gives the same turned. */
  height: number
}

export const CAMERA_HEIGHTS = [360, 540, 720, 1080] as const

export type GetUserMedia = (constraints: MediaStreamConstraints) => Promise<MediaStream>

/** The browser's way to cameras and microphones; null where the page is no secure context. */
export function browserGetUserMedia(): GetUserMedia | null {
  // Undefined without https, whatever the types say.
  const devices = navigator.mediaDevices as MediaDevices | undefined
  return devices === undefined ? null : (constraints) => devices.getUserMedia(constraints)
}

export function camera({ facing, height }: CameraChoice, getUserMedia: GetUserMedia): TrackConnector {
  // Wishes, not demands: a laptop has no camera at its back, and is a robot all the same.
  const video = { facingMode: { ideal: facing }, height: { ideal: height }, width: { ideal: Math.round((height * 16) / 9) }, frameRate: { ideal: 30 } }
  return {
    entry: mediaEntry('camera', 'video'),
    open: async () => {
      const track = await opened(() => getUserMedia({ video }), 'camera')
      // What moves is worth more than what is sharp, for whoever drives by it.
      track.contentHint = 'motion'
      return track
    },
  }
}

export function microphone(getUserMedia: GetUserMedia): TrackConnector {
  const audio = { echoCancellation: true, noiseSuppression: true, autoGainControl: true }
  return { entry: mediaEntry('microphone', 'audio'), open: () => opened(() => getUserMedia({ audio }), 'microphone') }
}

/** Ask for leave to use them, while somebody has just pressed a button; nothing stays open. Rejects with what to do. */
export async function askForTracks(connectors: readonly TrackConnector[]): Promise<void> {
  for (const connector of connectors) (await connector.open()).stop()
}

async function opened(open: () => Promise<MediaStream>, what: string): Promise<MediaStreamTrack> {
  try {
    const [track, ...more] = (await open()).getTracks()
    for (const other of more) other.stop()
    if (track === undefined) throw new DOMException('', 'NotFoundError')
    return track
  } catch (error) {
    throw new Error(captureProblem(error, what), { cause: error })
  }
}

/** Why there is no camera or microphone, in words that say what to do. */
export function captureProblem(error: unknown, what: string): string {
  switch (error instanceof Error || error instanceof DOMException ? error.name : '') {
    case 'NotAllowedError':
      return `This page may not use the ${what}. Allow it beside the address, then start again.`
    case 'NotFoundError':
    case 'OverconstrainedError':
      return `No ${what} was found on this device.`
    case 'NotReadableError':
    case 'AbortError':
      return `The ${what} can’t be used; another program may hold it.`
    default:
      return `The ${what} can’t be used (${error instanceof Error ? error.message : String(error)}).`
  }
}
