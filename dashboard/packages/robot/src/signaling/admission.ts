/** Decides which operators a robot takes, purely: matches what the server prepared with the offers that come. */
import type { IceCandidate, IceServer, PrepareConnection, SdpOffer } from '@mosaic/protocol'

/** An offer follows its preparation within a second; after a minute nobody is coming. */
const PREPARED_FOR_MS = 60_000
const MAX_PREPARED = 64
/** A browser has about ten; more is somebody filling our memory. */
const MAX_CANDIDATES = 64

/** An operator whom the server has announced, and what came of it before the offer. */
export interface Prepared {
  word: PrepareConnection
  candidates: readonly IceCandidate[]
}

/** What becomes of an offer. */
export type Admitted =
  | { type: 'start'; prepared: Prepared | null; iceServers: readonly IceServer[] }
  | { type: 'refuse'; code: string; message: string }
  /** The connection lives and has its offer: nobody is told anything. */
  | { type: 'ignore' }

interface Waiting {
  word: PrepareConnection
  candidates: IceCandidate[]
  atMs: number
}

/** Keeps the places of a robot and what is prepared for them. Each viewer costs the phone an encoder of its own. */
export class Admission {
  private readonly waiting = new Map<string, Waiting>()
  /** How many candidates each running peer has brought. */
  private readonly taken = new Map<string, number>()

  constructor(private readonly places: number) {}

  /** Whether nobody who comes could be given a place. */
  get isFull(): boolean {
    return this.taken.size >= this.places
  }

  /** The server announces an offer. */
  prepare(word: PrepareConnection, nowMs: number): void {
    this.forgetOld(nowMs)
    if (this.waiting.size >= MAX_PREPARED) this.waiting.delete([...this.waiting.keys()][0] ?? '')
    this.waiting.set(word.rtcConnectionId, { word, candidates: [], atMs: nowMs })
  }

  /** A candidate for a running peer goes on (true), one before its offer waits, one for nobody is dropped. */
  candidate(peerId: string, candidate: IceCandidate): boolean {
    const count = this.taken.get(peerId)
    if (count !== undefined) {
      this.taken.set(peerId, count + 1)
      return count < MAX_CANDIDATES
    }
    const waiting = this.waiting.get(peerId)
    if (waiting && waiting.candidates.length < MAX_CANDIDATES) waiting.candidates.push(candidate)
    return false
  }

  /** An offer takes a place, or is refused. `welcomed`: the ICE servers that the robot got when it signed in. */
  decide({ rtcConnectionId }: SdpOffer, welcomed: readonly IceServer[], nowMs: number): Admitted {
    this.forgetOld(nowMs)
    if (this.taken.has(rtcConnectionId)) return { type: 'ignore' }
    const prepared = this.waiting.get(rtcConnectionId) ?? null
    this.waiting.delete(rtcConnectionId)
    if (this.isFull) return { type: 'refuse', code: 'signal.robot_busy', message: `the robot already has ${this.places} operators` }
    this.taken.set(rtcConnectionId, prepared?.candidates.length ?? 0)
    return { type: 'start', prepared, iceServers: prepared?.word.iceServers ?? welcomed }
  }

  /** The peer is over; whether it had a place. */
  leave(peerId: string): boolean {
    this.waiting.delete(peerId)
    return this.taken.delete(peerId)
  }

  private forgetOld(nowMs: number): void {
    for (const [peerId, { atMs }] of this.waiting) if (nowMs - atMs > PREPARED_FOR_MS) this.waiting.delete(peerId)
  }
}
