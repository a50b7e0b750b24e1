import type { IceCandidate } from '@mosaic/protocol'

/** Applies the robot's candidates to one peer connection; those that come before its answer wait for that. */
export class RemoteCandidates {
  private readonly early: IceCandidate[] = []
  private isClosed = false

  constructor(private readonly connection: RTCPeerConnection) {}

  /** One that the browser can't use is not worth more than a line on the console. */
  async add(candidate: IceCandidate): Promise<void> {
    if (this.connection.remoteDescription === null) this.early.push(candidate)
    else await this.use(candidate)
  }

  /** The answer is applied. */
  async answered(): Promise<void> {
    for (const candidate of this.early.splice(0)) await this.use(candidate)
  }

  close(): void {
    this.isClosed = true
  }

  private async use(candidate: IceCandidate): Promise<void> {
    if (this.isClosed) return
    try {
      await this.connection.addIceCandidate(candidate)
    } catch (error) {
      console.warn('mosaic: a candidate of the robot was not usable', error)
    }
  }
}
