/** How far this machine's wall clock is from the server's, by the `Date` header; Python judges by the same limits. */
import type { Finding } from '@mosaic/protocol'
import { passed, warned } from './findings'

/** `Date` has whole seconds (RFC 9110 §5.6.7). */
const DATE_STEP_MS = 1000
const NOTICEABLE_MS = 5000

export interface ClockSkew {
  /** Positive if this machine's clock is ahead. */
  aheadMs: number
  errorMs: number
}

export function clockSkew(askedAtMs: number, answeredAtMs: number, serverDateMs: number): ClockSkew {
  // The header was cut off to whole seconds: on average the server's clock was half a second later.
  const aheadMs = (askedAtMs + answeredAtMs) / 2 - (serverDateMs + DATE_STEP_MS / 2)
  return { aheadMs, errorMs: (answeredAtMs - askedAtMs) / 2 + DATE_STEP_MS / 2 }
}

export function clockFinding({ aheadMs, errorMs }: ClockSkew): Finding {
  const facts = { aheadS: Math.round(aheadMs / 100) / 10 }
  if (Math.abs(aheadMs) - errorMs > NOTICEABLE_MS) {
    const seconds = Math.round(Math.abs(aheadMs) / 1000)
    const sentence = `This machine's clock is ${seconds} s ${aheadMs > 0 ? 'ahead of' : 'behind'} the server's.`
    return warned('server.clock', 'signal.clock_skew', { sentence, facts })
  }
  const within = Math.ceil((Math.abs(aheadMs) + errorMs) / 1000)
  return passed('server.clock', `The clocks of this machine and of the server agree (within ${within} s).`, facts)
}
