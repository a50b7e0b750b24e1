import type { ReasonCode } from './generated'

/** Bytes from the other side that make no sense; the message is safe to show and quotes no secret. */
export class WireError extends Error {
  override readonly name = 'WireError'

  constructor(
    message: string,
    readonly code: ReasonCode = 'signal.bad_message',
  ) {
    super(message)
  }
}
