import type { Catalogue, Refusal } from '@mosaic/protocol'
import type { Readable } from './Readable'
import type { ConnectionState } from './types'

/** The one connection of this page to one robot. */
export interface RobotConnection {
  readonly robotId: string
  readonly state: Readable<ConnectionState>
  /** Short form from the server, full (with message schemas) once connected. */
  readonly catalogue: Readable<Catalogue | null>
  /** Messages that the robot did not accept. */
  readonly refusals: { subscribe(listener: (refusal: Refusal) => void): () => void }
  /** Connect and stay connected until `disconnect`; repeated calls do nothing, after a failure one tries again. */
  connect(): void
  disconnect(): void
}
