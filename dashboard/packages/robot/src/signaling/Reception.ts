import type { IceCandidate, IceServer, SdpOffer, SignalingMessages, TicketKey } from '@mosaic/protocol'
import { wallClockMs, type SignalingSocket } from '@mosaic/client/parts'
import { Admission, type Prepared } from './admission'
import { BadTicket, identityOf, type Identity, type Verify } from './tickets'

/** An operator whom the robot takes. `candidates` came before the offer, or while its ticket was checked. */
export interface Introduction {
  offer: SdpOffer
  identity: Identity
  iceServers: readonly IceServer[]
  candidates: readonly IceCandidate[]
}

export interface ReceptionOptions {
  robotId: string
  places: number
  verify: Verify
  now: () => number
  taken: (introduction: Introduction) => void
  /** Somebody's ticket did not count, and why. */
  refused: (why: string) => void
}

/** Receives operators whom the server sends: checks their tickets, and refuses whoever has none or finds no place. */
export class Reception {
  private readonly admission: Admission
  /** The candidates of those whose tickets are being checked. */
  private readonly arriving = new Map<string, IceCandidate[]>()
  private keys: readonly TicketKey[] = []
  private iceServers: readonly IceServer[] = []

  constructor(
    private readonly options: ReceptionOptions,
    private readonly socket: Pick<SignalingSocket, 'send'>,
  ) {
    this.admission = new Admission(options.places)
  }

  /** Whether nobody who comes could be given a place. */
  get isFull(): boolean {
    return this.admission.isFull
  }

  welcomed({ keys, iceServers }: SignalingMessages['session.welcome']): void {
    this.keys = keys
    this.iceServers = iceServers
  }

  prepare(word: SignalingMessages['signaling.prepare_connection']): void {
    this.admission.prepare(word, this.options.now())
  }

  offered(offer: SdpOffer): void {
    const decision = this.admission.decide(offer, this.iceServers, this.options.now())
    if (decision.type === 'ignore') return
    if (decision.type === 'refuse') return this.refuse(offer, decision.code, decision.message)
    void this.take(offer, decision.prepared, decision.iceServers)
  }

  /** Whether the candidate is for a peer that was taken; one for somebody who is still checked waits here. */
  candidate(peerId: string, candidate: IceCandidate): boolean {
    if (!this.admission.candidate(peerId, candidate)) return false
    const waiting = this.arriving.get(peerId)
    waiting?.push(candidate)
    return waiting === undefined
  }

  /** Whoever is still checked is not taken. */
  turnAway(peerId: string): void {
    if (this.arriving.delete(peerId)) this.admission.leave(peerId)
  }

  turnAllAway(): void {
    for (const peerId of [...this.arriving.keys()]) this.turnAway(peerId)
  }

  /** The peer is over: its place is free. */
  left(peerId: string): void {
    this.admission.leave(peerId)
  }

  private async take(offer: SdpOffer, prepared: Prepared | null, iceServers: readonly IceServer[]): Promise<void> {
    const peerId = offer.rtcConnectionId
    const candidates = [...(prepared?.candidates ?? [])]
    this.arriving.set(peerId, candidates)
    try {
      const identity = await this.identityOf(prepared)
      // Gone meanwhile, or this robot is.
      if (this.arriving.delete(peerId)) this.options.taken({ offer, identity, iceServers, candidates })
    } catch (error) {
      if (!(error instanceof BadTicket)) throw error
      this.turnAway(peerId)
      this.options.refused(error.message)
      this.refuse(offer, 'auth.bad_ticket', error.message)
    }
  }

  private async identityOf(prepared: Prepared | null): Promise<Identity> {
    if (prepared === null) throw new BadTicket('the offer came without a ticket')
    const { robotId, verify } = this.options
    return identityOf({ robotId, prepared: prepared.word, keys: this.keys, wallS: wallClockMs() / 1000, verify })
  }

  private refuse({ rtcConnectionId }: SdpOffer, code: string, message: string): void {
    this.socket.send('signaling.close_peer_connection', { rtcConnectionId, code, message })
  }
}
