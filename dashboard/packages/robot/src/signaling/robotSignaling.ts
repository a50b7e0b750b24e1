import type { SignalingMessage, SignalingMessages } from '@mosaic/protocol'
import { SignalingSession, type SignalingEffect } from '@mosaic/client/parts'

/**
 * Decides for a robot: it signs in with its token, and where both sides know extensions the session can be used once the
 * server has welcomed it, with its ICE servers and the keys of its tickets.
 */
export class RobotSignaling extends SignalingSession {
  private isAccepted = false

  constructor(
    private readonly robotId: string,
    draw: () => number,
  ) {
    super(draw)
  }

  /** Whether an operator's ticket can be expected. */
  get expectsTickets(): boolean {
    return 'tickets' in this.agreed
  }

  protected override credentials(): SignalingMessages['authorize'] {
    this.isAccepted = false
    return { robotId: this.robotId, data: this.token }
  }

  protected override accepted(): SignalingEffect[] {
    this.isAccepted = true
    return Object.keys(this.agreed).length === 0 ? this.becomeOnline() : []
  }

  protected override heardMore(message: SignalingMessage): SignalingEffect[] {
    const isWelcome = message.type === 'session.welcome' && this.isAccepted && this.current === 'authorizing'
    // Told first: whoever hears that the robot is online knows the keys.
    return isWelcome ? [{ type: 'tellMessage', message }, ...this.becomeOnline()] : super.heardMore(message)
  }

  /** A socket of a network that is gone does not know it, and nobody could reach the robot meanwhile. */
  protected override networkChanged(nowMs: number): SignalingEffect[] {
    return this.current === 'online' ? [{ type: 'close' }, ...this.open(nowMs)] : super.networkChanged(nowMs)
  }
}
