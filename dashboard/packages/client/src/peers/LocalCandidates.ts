import type { IceCandidate } from '@mosaic/protocol'

/** This page's candidates for one peer connection: they leave as they are found, or wait until the other end can take them. */
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
