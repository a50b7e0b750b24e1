import { reasonOf } from '@mosaic/protocol'

/** Says that something failed, with a reason code, a sentence for people and what to do about it. */
export class MosaicError extends Error {
  /** 'MosaicError', also where classes lost their names. */
  override readonly name = 'MosaicError'
  /** What to do about it; empty where nobody knows. */
  readonly cure: string

  constructor(
    /** The reason code, as in the reference: `auth.required`, `ice.failed`, … */
    readonly code: string,
    message = '',
    cure = '',
    /** Where the server's REST interface refused; null otherwise. */
    readonly httpStatus: number | null = null,
  ) {
    super(message || reasonOf(code).sentence)
    this.cure = cure || reasonOf(code).cure
  }
}
