import type { IceCandidate } from '@mosaic/protocol'

/** Sends this page's candidates for one peer connection as they are found, or holds them until the other end takes them. */
export class LocalCandidates {
  private held: IceCandidate[] | null

  constructor(
    private readonly send: (candidate: IceCandidate) => void,
    { isHeld }: { isHeld: boolean },
  ) {
    this.held = isHeld ? [] : null
  }

  found(candidate: IceCandidate): void {
    if (this.held === null) this.send(candidate)
    else this.held.push(candidate)
  }

  /** The other end takes them now. */
  release(): void {
    const held = this.held ?? []
    this.held = null
    for (const candidate of held) this.send(candidate)
  }
}
