/** The parts of the wire that the REST interface carries too, read as tolerantly and as strictly. */
import type { Catalogue, IceServer } from './generated'
import { Mismatch, validated } from './validated'
import { WireError } from './WireError'

/** Throws `WireError`. `urls` may be one string, as original servers write it. */
export function parseIceServers(value: unknown): IceServer[] {
  if (!Array.isArray(value)) throw new WireError('ICE servers: not a list')
  return value.map((entry) => fitting('IceServer', entry) as IceServer)
}

/** Throws `WireError`; null where the robot announced none. */
export function parseCatalogue(value: unknown): Catalogue | null {
  return value === null || value === undefined ? null : (fitting('Catalogue', value) as Catalogue)
}

function fitting(name: string, value: unknown): unknown {
  try {
    return validated(name, value)
  } catch (error) {
    if (error instanceof Mismatch) throw new WireError(`${name}: wrong or missing ${error.message}`)
    throw error
  }
}
