import type { messages } from '@mosaic/protocol'
import { microseconds, wallClockMs } from '@mosaic/client/parts'
import { dataEntry } from './catalogue'
import type { DataConnector, DataTeller } from './Connector'

type Log = messages.Log

/** Tells what happens on this robot, line by line, to whoever listens; who comes late gets the last line. */
export class LogConnector implements DataConnector {
  readonly entry = dataEntry('log', 'Log', 'reliable')
  private teller: DataTeller | null = null

  start(teller: DataTeller): () => void {
    this.teller = teller
    return () => (this.teller = null)
  }

  say(level: Log['level'], message: string): void {
    const line: Log = { level, message, timestamp: microseconds(wallClockMs()) }
    this.teller?.tell(line)
  }
}
