import type { SignalingMessages } from '@mosaic/protocol'
import { SignalingSession, type SignalingEffect } from './signalingSession'

/** Decides for an operator: its access token says who it is, and once that is taken the session can be used. */
export class OperatorSignaling extends SignalingSession {
  protected override credentials(): SignalingMessages['authorize'] {
    return { accessToken: this.token }
  }

  protected override accepted(): SignalingEffect[] {
    return this.becomeOnline()
  }
}
