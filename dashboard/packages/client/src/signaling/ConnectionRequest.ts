import type { Catalogue, IceServer } from '@mosaic/protocol'
import { MosaicError } from '../words/MosaicError'
import type { RestApi } from './RestApi'
import type { SessionIds } from './SessionIds'
import type { RobotInfo } from '../words/types'

/** How long somebody waits for the server's fresh credentials. */
const FRESH_ICE_MS = 1000

export interface Granted {
  rtcConnectionId: string
  iceServers: readonly IceServer[]
  /** Null where it was known, or there is none. */
  catalogue: Catalogue | null
  /** What people say of a robot that announces nothing; null where that is known. */
  robot: RobotInfo | null
}

export interface RequestListener {
  granted(granted: Granted): void
  failed(code: string, message: string): void
}

/** Asks the server for what an attempt to reach a robot needs: leave to try, ICE servers, perhaps the catalogue. */
export class ConnectionRequest {
  /** Counts requests, so that the answer to one that was given up is recognized. */
  private number = 0
  private iceServers: readonly IceServer[] = []

  constructor(
    private readonly robotId: string,
    private readonly server: { readonly api: RestApi; readonly sessionIds: SessionIds },
  ) {}

  /** Ask; whatever was asked before is given up. `isKnown`: the robot or its server said what connectors it has. */
  async make(isKnown: boolean, listener: RequestListener): Promise<void> {
    const number = ++this.number
    const { api, sessionIds } = this.server
    try {
      const [grant, iceServers, catalogue, robot] = await Promise.all([
        api.createConnection(this.robotId, sessionIds.of(this.robotId)),
        api.iceServers().catch((): IceServer[] => []),
        // Toward an original server there is none to be had.
        isKnown ? null : api.catalogue(this.robotId).catch(() => null),
        isKnown ? null : api.robot(this.robotId).catch(() => null),
      ])
      if (number !== this.number) return
      if (grant.sessionId !== undefined) sessionIds.remember(this.robotId, grant.sessionId)
      this.iceServers = iceServers
      listener.granted({ rtcConnectionId: grant.rtcSessionId, iceServers, catalogue, robot })
    } catch (error) {
      if (number === this.number) failed(error, listener)
    }
  }

  /** Nobody waits for the answer any more. */
  giveUp(): void {
    this.number += 1
  }

  /** For a further peer connection: the server need not be there, and the credentials of the first may still do. */
  freshIceServers(): Promise<readonly IceServer[]> {
    const known = this.iceServers
    if (known.length === 0) return Promise.resolve(known)
    const late = new Promise<readonly IceServer[]>((resolve) => setTimeout(() => resolve(known), FRESH_ICE_MS))
    return Promise.race([this.server.api.iceServers().catch(() => known), late])
  }
}

// Nothing that we know of throws anything else than our own; a browser without WebRTC does.
function failed(error: unknown, listener: RequestListener): void {
  if (error instanceof MosaicError) listener.failed(error.code, error.message)
  else listener.failed('sdp.invalid', String(error))
}
