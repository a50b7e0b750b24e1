/** A robot whose control desk a test sets: what the page says to it is kept, what it says is whatever the test sets. */
import { MantineProvider } from '@mantine/core'
import {
  Value,
  type Availability,
  type Catalogue,
  type ClearReport,
  type ConnectionState,
  type ControlEvent,
  type JournalEntry,
  type LeaseView,
  type MosaicClient,
  type PeerView,
  type SafetyLimit,
  type ServerState,
  type StopReport,
  type StopView,
} from '@mosaic/client'
import { MosaicProvider } from '@mosaic/react'
import type { ReactNode } from 'react'

export const ME: PeerView = { peerId: 'me', name: 'Mia', role: 'operator', isPerson: true, isOriginal: false, isMe: true }
export const ALICE: PeerView = { peerId: 'alice', name: 'Alice', role: 'operator', isPerson: true, isOriginal: false, isMe: false }
export const PATROL: PeerView = { peerId: 'patrol', name: 'patrol', role: 'operator', isPerson: false, isOriginal: false, isMe: false }

export const FREE: LeaseView = { resource: 'motion', state: 'free', holder: null, isMine: false, epoch: 0, queue: [], request: null, ended: null }
export const MINE: LeaseView = { ...FREE, state: 'mine', holder: ME, isMine: true, epoch: 7 }
export const ALICES: LeaseView = { ...FREE, state: 'other', holder: ALICE }

export const SENDING: StopReport = { id: 's1', reason: '', phase: 'sending', copies: 1, acknowledgedMs: null, receivedMs: null, safeMs: null }
export const SAFE: StopReport = { ...SENDING, phase: 'safe', acknowledgedMs: 21, receivedMs: 11, safeMs: 43.2 }
const RUNNING: StopView = { isStopped: false, by: '', reason: '', mine: null }

export class FakeDesk {
  readonly availability = new Value<Availability>('available')
  readonly me = new Value<PeerView | null>(ME)
  readonly peers = new Value<readonly PeerView[]>([ME])
  readonly leases = new Value<Readonly<Record<string, LeaseView>>>({ motion: FREE })
  readonly stopState = new Value<StopView>(RUNNING)
  readonly limits = new Value<Readonly<Record<string, SafetyLimit>>>({})
  readonly restable = new Value<readonly string[]>([])
  readonly said: unknown[][] = []
  journal: readonly JournalEntry[] = []
  clocksCompared = true
  clearAnswer: ClearReport = { isCleared: true }
  private readonly listeners = new Set<(event: ControlEvent) => void>()
  readonly events = {
    subscribe: (listener: (event: ControlEvent) => void) => {
      this.listeners.add(listener)
      return () => this.listeners.delete(listener)
    },
  }

  setLease(lease: LeaseView): void {
    this.leases.set({ ...this.leases.get(), [lease.resource]: lease })
  }

  tell(event: ControlEvent): void {
    for (const listener of this.listeners) listener(event)
  }

  requestLease(resource?: string, options?: object): boolean {
    return this.said.push(options === undefined ? ['request', resource] : ['request', resource, options]) > 0
  }

  releaseLease(resource: string): boolean {
    return this.said.push(['release', resource]) > 0
  }

  changeStopRight(...right: unknown[]): boolean {
    return this.said.push(['right', ...right]) > 0
  }

  answerLease(...answer: unknown[]): boolean {
    return this.said.push(['answer', ...answer]) > 0
  }

  stop(reason = ''): Promise<StopReport> {
    this.said.push(['stop', reason])
    return Promise.resolve(SAFE)
  }

  clearStop(): Promise<ClearReport> {
    this.said.push(['clear'])
    return Promise.resolve(this.clearAnswer)
  }

  addRest(label: string): () => void {
    this.restable.set([...this.restable.get(), label])
    return () => this.restable.set(this.restable.get().filter((one) => one !== label))
  }

  toPageMs(robotUs: number): number | null {
    return this.clocksCompared ? robotUs / 1000 : null
  }

  readJournal(): Promise<readonly JournalEntry[]> {
    return Promise.resolve(this.journal)
  }
}

export class FakeConnection {
  readonly control = new FakeDesk()
  readonly catalogue = new Value<Catalogue | null>(null)
  readonly state = new Value<ConnectionState>({ phase: 'connected', roundTripMs: 8 })
}

export function WithRobot({ connection, client = {}, children }: { connection: FakeConnection; client?: object; children: ReactNode }) {
  const fake = { connection: () => connection, server: new Value<ServerState>('online'), ...client } as unknown as MosaicClient
  return (
    <MantineProvider env="test">
      <MosaicProvider client={fake}>{children}</MosaicProvider>
    </MantineProvider>
  )
}
