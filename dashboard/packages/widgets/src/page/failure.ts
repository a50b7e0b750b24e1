import { MosaicError } from '@mosaic/client'

/** What went wrong, and what to do about it, in words for people. */
export interface Failure {
  code: string
  message: string
  cure: string
}

/** Whoever guessed too often is told by the server how long to wait. */
const TOO_MANY_REQUESTS = 429

/** The same where a person typed them: what robots sign in with is none of their concern. */
export function signInFailureOf(error: unknown): Failure {
  const failure = failureOf(error)
  const isWrong = failure.code === 'auth.failed' && !(error instanceof MosaicError && error.httpStatus === TOO_MANY_REQUESTS)
  return isWrong ? { ...failure, cure: 'Check the email and the password.' } : failure
}

/** The failure that an error is, in words for people. */
export function failureOf(error: unknown): Failure {
  if (error instanceof MosaicError) return { code: error.code, message: error.message, cure: error.cure }
  return { code: '', message: error instanceof Error ? error.message : String(error), cure: '' }
}
