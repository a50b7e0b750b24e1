/** What of this device is shared, and how the robot is made of it. */
import type { Platform } from '@mosaic/client'
import {
  askForMotion,
  askForPosition,
  askForTracks,
  audioPlayer,
  battery,
  browserGetBattery,
  browserGetUserMedia,
  browserPictureTimes,
  browserVerify,
  camera,
  microphone,
  motion,
  PageRobot,
  position,
  type CameraChoice,
  type RobotCredentials,
} from '@mosaic/robot'

export const SHARED = ['camera', 'microphone', 'loudspeaker', 'position', 'motion', 'battery'] as const
export type Shared = (typeof SHARED)[number]

export interface Choices {
  shared: Readonly<Record<Shared, boolean>>
  camera: CameraChoice
}

/** Sound and the whereabouts of a person are shared by who switches them on, not by who overlooks them. */
export const FIRST_CHOICES: Choices = {
  shared: { camera: true, microphone: false, loudspeaker: false, position: false, motion: true, battery: true },
  camera: { facing: 'environment', height: 720 },
}

/** What this browser has; without https it is next to nothing. */
export function sharable(): readonly Shared[] {
  const hasMedia = browserGetUserMedia() !== null
  const has: Record<Shared, boolean> = {
    camera: hasMedia,
    microphone: hasMedia,
    loudspeaker: true,
    // It is there without https, and refuses.
    position: window.isSecureContext && 'geolocation' in navigator,
    motion: 'DeviceMotionEvent' in window,
    battery: browserGetBattery(navigator) !== null,
  }
  return SHARED.filter((one) => has[one])
}

/** What a person allows of what is to be shared, and what became of the rest. */
export interface Leave {
  granted: Choices
  problems: Partial<Record<Shared, string>>
}

/** Ask the person for all of it, in the moment of the press; nothing stays open. Throws where nothing is allowed at all. */
export async function askFor(choices: Choices): Promise<Leave> {
  const getUserMedia = browserGetUserMedia()
  const problems: Partial<Record<Shared, string>> = {}
  const ask = async (one: Shared, asked: () => Promise<void>): Promise<void> => {
    if (choices.shared[one]) await asked().catch((error: unknown) => void (problems[one] = messageOf(error)))
  }
  // First: iOS takes the press for granted only until something is awaited.
  await ask('motion', () => askForMotion(window))
  if (getUserMedia !== null) {
    await ask('camera', () => askForTracks([camera(choices.camera, getUserMedia)]))
    await ask('microphone', () => askForTracks([microphone(getUserMedia)]))
  }
  await ask('position', () => askForPosition(navigator.geolocation))
  const entries = SHARED.map((one) => [one, choices.shared[one] && problems[one] === undefined] as const)
  const granted = { ...choices, shared: Object.fromEntries(entries) as Choices['shared'] }
  if (!entries.some(([, isGranted]) => isGranted)) throw new Error(Object.values(problems)[0])
  return { granted, problems }
}

function messageOf(error: unknown): string {
  return error instanceof Error ? error.message : String(error)
}

export function robotOf(credentials: RobotCredentials, { shared, camera: choice }: Choices, platform: Platform): PageRobot {
  const getUserMedia = browserGetUserMedia()
  const getBattery = browserGetBattery(navigator)
  return new PageRobot({
    platform,
    baseUrl: window.location.origin,
    credentials,
    tracks: [
      ...(shared.camera && getUserMedia ? [camera(choice, getUserMedia)] : []),
      ...(shared.microphone && getUserMedia ? [microphone(getUserMedia)] : []),
    ],
    data: [
      ...(shared.position ? [position(navigator.geolocation)] : []),
      ...(shared.motion ? [motion(window, () => platform.now())] : []),
      ...(shared.battery && getBattery ? [battery(getBattery)] : []),
    ],
    play: shared.loudspeaker ? audioPlayer : null,
    verify: browserVerify(),
    pictureTimes: browserPictureTimes(),
  })
}
