import { reasonOf } from '@mosaic/protocol'

/** Something failed, with a reason code, a sentence for people and what to do about it. */
export class MosaicError extends Error {
  override readonly name = 'MosaicError'
  readonly cure: string

  constructor(
    readonly code: string,
    message = '',
    cure = '',
    readonly httpStatus: number | null = null,
  ) {
    super(message || reasonOf(code).sentence)
    this.cure = cure || reasonOf(code).cure
  }
}
