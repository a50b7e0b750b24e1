import { Value, type Readable, type ServerState } from '@mosaic/client'
import type { LogConnector } from './connectors/LogConnector'
import type { Viewer } from './peers/PeersHere'

/** What the page of the robot shows. */
export interface PageRobotState {
  server: ServerState
  /** Why the server takes this robot no more; null: it does, or will. */
  refusal: string | null
  viewers: readonly Viewer[]
  /** What is filmed or heard right now. */
  captured: Readonly<Record<string, MediaStreamTrack>>
  /** What a connector can't do, and what a person can do about it. */
  problems: Readonly<Record<string, string>>
  isStopped: boolean
}

const RESTING: PageRobotState = { server: 'offline', refusal: null, viewers: [], captured: {}, problems: {}, isStopped: false }

/** Keeps what the page of a robot shows of it, and tells its log what is news. */
export class RobotView {
  private readonly value = new Value<PageRobotState>(RESTING)

  readonly state: Readable<PageRobotState> = this.value

  constructor(private readonly log: Pick<LogConnector, 'say'>) {}

  show(change: Partial<PageRobotState>): void {
    this.value.set({ ...this.value.get(), ...change })
  }

  /** A camera or microphone is on (`track`), off, or can't be used. */
  captureChanged(label: string, track: MediaStreamTrack | null, problem: string): void {
    const others = without(this.value.get().captured, label)
    this.show({ captured: track === null ? others : { ...others, [label]: track } })
    if (problem === '') this.log.say('info', `${label} ${track === null ? 'off: nobody watches' : 'on'}`)
    this.problem(label, problem)
  }

  /** Empty: it is well again. */
  problem(label: string, problem: string): void {
    const { problems } = this.value.get()
    if (problem === (problems[label] ?? '')) return
    const others = without(problems, label)
    this.show({ problems: problem === '' ? others : { ...others, [label]: problem } })
    if (problem !== '') this.log.say('warn', `${label}: ${problem}`)
  }
}

function without<T>(record: Readonly<Record<string, T>>, key: string): Record<string, T> {
  return Object.fromEntries(Object.entries(record).filter(([name]) => name !== key))
}
