/** What happens to one robot's connection, and what is to be done about it. */
import type { DeadlinePassed } from '../timing/MachineDriver'

export type PeerPhase =
  | 'idle'
  | 'requesting' // the server is asked for a connection
  | 'offering' // the browser makes the offer
  | 'answering' // the robot's answer is awaited
  | 'linking' // ICE and DTLS
  | 'opening' // the control channel
  | 'up'
  | 'waiting' // for the next attempt
  | 'suspended' // the page was left and may come back
  | 'failed'
  | 'closed'

export type PeerEvent =
  | { type: 'connectWanted' }
  | { type: 'disconnectWanted' }
  | { type: 'pageHidden' }
  | { type: 'pageShown' }
  /** The robot or the server came (back) online. */
  | { type: 'robotReady' }
  | { type: 'granted' }
  | { type: 'offered' }
  | { type: 'answered' }
  | { type: 'iceConnected' }
  | { type: 'linkConnected' }
  | { type: 'controlOpened' }
  | { type: 'helloHeard' }
  /** Any message of the robot on the control channel. */
  | { type: 'robotHeard' }
  /** Whatever went wrong, on our side, on the way or by the robot's own word. */
  | { type: 'broken'; code: string; message?: string }
  /** The network is another one, or the transport hesitates: a word of the robot within this time, or it is lost. */
  | { type: 'doubted'; patienceMs: number }
  | DeadlinePassed

export type PeerEffect =
  /** A new attempt: tell the stores and ask the server for a connection. */
  | { type: 'request' }
  | { type: 'makeOffer' }
  | { type: 'sendHello' }
  | { type: 'sendPing' }
  /** No hello: an original robot, bare channels, watch everything. */
  | { type: 'treatAsOriginal' }
  /** Drop the peer connection; `bye` if the robot shall hear that this was on purpose. */
  | { type: 'drop'; bye: boolean }
  | { type: 'tellConnected' }
  | { type: 'tellDisconnected'; code?: string; message?: string }
  | { type: 'tellFailed'; code: string; message?: string }
