import type { ReasonCode } from './generated'

/** Says that bytes from the other side make no sense; the message is safe to show and quotes no secret. */
export class WireError extends Error {
  /** `WireError`, by which it is told from other errors. */
  override readonly name = 'WireError'

  constructor(
    message: string,
    /** A code of `REASONS`. */
    readonly code: ReasonCode = 'signal.bad_message',
  ) {
    super(message)
  }
}
