/** What the page is shown of who commands a robot, of its stop and of its limits. */
import type { LeaseWaiting, PeerInfo } from '@mosaic/protocol'

/** `unknown`: not connected, or the robot has not said hello; `unavailable`: an original robot knows none of this. */
export type Availability = 'unknown' | 'available' | 'unavailable'

/** What the server lets somebody do with a robot. */
export type Role = PeerInfo['role']

/** Somebody who is connected to the robot. */
export interface PeerView extends PeerInfo {
  isMe: boolean
}

/** Why something was refused or ended: a reason code, and what the robot adds. */
export interface Why {
  code: string
  message?: string
}

/** My request for a lease, while it has not been granted. `place` in the queue, 1 being next; 0 while not answered. */
export interface LeaseRequestView extends Why {
  phase: 'asked' | 'queued'
  place: number
}

/** Who commands one resource of the robot, as a button shows it. */
export interface LeaseView {
  resource: string
  state: 'free' | 'mine' | 'other'
  holder: PeerView | null
  isMine: boolean
  /** What my commands carry; 0 while the lease isn't mine. */
  epoch: number
  /** Who waits; while `isMine` these are asking me. */
  queue: readonly LeaseWaiting[]
  request: LeaseRequestView | null
  /** Why my last lease ended, or my last request was denied; null after the next one. */
  ended: Why | null
}

/** How far a stop has come. The times count from the moment it was said. */
export interface StopReport {
  id: string
  reason: string
  /**
   * `sending` → `acknowledged`: the robot has it → `safe`: every safe action has returned. `unconfirmed`: the connection
   * ended first; `unavailable`: an original robot.
   */
  phase: 'sending' | 'acknowledged' | 'safe' | 'unconfirmed' | 'unavailable'
  /** How often it was sent. */
  copies: number
  /** Until the acknowledgement was here. */
  acknowledgedMs: number | null
  /** Until the robot had it; null while the clocks have not been compared. */
  receivedMs: number | null
  /** Until the robot's last safe action had returned. */
  safeMs: number | null
  /** With `unavailable`: what was sent in its place. */
  zeros?: ZerosReport
}

/** Zeros for a robot that knows no stop, by connector: what left the page, and what did not because no channel took it. */
export interface ZerosReport {
  sent: readonly string[]
  unsent: readonly string[]
}

/** Whether the robot is stopped, and how my own last stop went. */
export interface StopView {
  isStopped: boolean
  by: string
  reason: string
  /** Robot's clock. */
  sinceUs?: number
  mine: StopReport | null
}

/** What came of `clearStop`. */
export type ClearReport = { isCleared: true } | ({ isCleared: false } & Why)

/** Why a store lets nothing through. */
export type SendBlock = Why

/** Things that happen once, for a notice. */
export type ControlEvent =
  | { type: 'granted'; resource: string }
  | ({ type: 'queued'; resource: string } & Why)
  | ({ type: 'denied'; resource: string } & Why)
  /** A lease of mine ended, and I did not give it back. */
  | ({ type: 'lost'; resource: string } & Why)
  /** Somebody new waits for what I hold. */
  | { type: 'asked'; resource: string; by: LeaseWaiting }
  | { type: 'stopped'; by: string; reason: string }
  | { type: 'cleared' }
  /** A supervisor, called `by` where the robot tells, took from an observer the right to say stop, or gave it back. */
  | { type: 'stopRight'; of: PeerView; mayStop: boolean; by: string }

/** `code` and, where there is one, `message` of an answer. */
export function whyOf({ code, message }: { code: string; message?: string }): Why {
  return message === undefined ? { code } : { code, message }
}
