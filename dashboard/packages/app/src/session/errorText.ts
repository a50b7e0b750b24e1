import { MosaicError } from '@mosaic/client'

export interface Failure {
  code: string
  message: string
  cure: string
}

/** What went wrong, and what to do about it, in words for people. */
export function failureOf(error: unknown): Failure {
  if (error instanceof MosaicError) return { code: error.code, message: error.message, cure: error.cure }
  return { code: '', message: error instanceof Error ? error.message : String(error), cure: '' }
}
