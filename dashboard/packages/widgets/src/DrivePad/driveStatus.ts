/** What the pad says about itself, in one line. */
import { isHeld, type DriveState, type StopReason } from './driveControl'
import type { PermitView } from './drivePermit'

export type DriveTone = 'idle' | 'driving' | 'waiting' | 'blocked' | 'stopped'

export interface DriveStatus {
  tone: DriveTone
  text: string
}

const STOPPED: Record<StopReason, string> = {
  released: 'Ready',
  'stop-key': 'Stopped by the space bar',
  blur: 'Stopped: the window lost the focus',
  hidden: 'Stopped: the page was hidden',
  pagehide: 'Stopped: the page was left',
  disconnected: 'Stopped: the connection was lost',
  unmount: 'Stopped',
  pointercancel: 'Stopped: the touch was interrupted',
  lostcapture: 'Stopped: the touch was interrupted',
  late: 'Stopped: the page was too slow to drive safely',
  unplugged: 'Stopped: the gamepad was unplugged',
  escape: 'Stopped by Escape',
  'stop-button': 'Stopped by the stop button',
  'lease-lost': 'Stopped: you no longer have control',
  'robot-stopped': 'Stopped: the robot was stopped',
  'out-of-sight': 'Stopped: the leading picture left the screen',
  'not-granted': 'Nothing was sent: control was not granted',
}

export interface DriveCircumstances {
  /** The channel did not take the last command. */
  isBlocked?: boolean
  /** The robot makes itself safe when it is told nothing more. */
  stopsItself?: boolean
}

const GOES_ON = 'The connection was lost, and nothing is known to stop this robot: it may go on as last told'
const ZEROS_SENT = 'Zeros sent; not confirmed'
const NO_ZERO = 'Not stopped: the link did not take the zero'

export function driveStatus(state: DriveState, { isBlocked = false, stopsItself = true }: DriveCircumstances = {}): DriveStatus {
  if (!state.enabled && state.stoppedBy === 'disconnected') {
    return stopsItself ? { tone: 'waiting', text: STOPPED.disconnected } : { tone: 'blocked', text: GOES_ON }
  }
  if (!state.enabled) return { tone: 'waiting', text: 'Waiting for the robot' }
  if (state.askedMs !== null) return { tone: 'waiting', text: 'Asking for control …' }
  if (isHeld(state) && isBlocked) return { tone: 'blocked', text: 'The link does not take commands' }
  if (isHeld(state)) return { tone: 'driving', text: 'Driving' }
  const stopped = state.stoppedBy
  if (stopped !== null && isBlocked && !stopsItself) return { tone: 'blocked', text: NO_ZERO }
  if (stopped === 'stop-button' && !stopsItself) return { tone: 'stopped', text: ZEROS_SENT }
  return stopped === null || stopped === 'released'
    ? { tone: 'idle', text: 'Ready' }
    : { tone: 'stopped', text: STOPPED[stopped] }
}

/** The same with what stands in the way: who commands, the stop, the role. Without a channel that is the first to say. */
export function driveStatusWith(status: DriveStatus, { permit, text }: PermitView): DriveStatus {
  const isOpen = status.tone !== 'waiting'
  if (permit === 'refused' && isOpen) return { tone: 'waiting', text }
  return permit === 'free' && status.tone === 'idle' ? { tone: 'idle', text } : status
}
