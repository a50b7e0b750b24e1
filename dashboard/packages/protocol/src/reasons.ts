/** The one table of reason codes, as the dashboard shows it. */
import { CLOSE_REASONS, REASONS, RESULT_REASONS, ResultCode, type ReasonCode } from './generated'

/** One reason code in words. */
export interface Reason {
  code: string
  sentence: string
  cure: string
}

/** What a code means and what to do about it; a code that we don't know speaks for itself. */
export function reasonOf(code: string): Reason {
  return isReasonCode(code) ? { code, ...REASONS[code] } : { code, sentence: code, cure: '' }
}

/** Whether the table of reason codes has this one. */
export function isReasonCode(code: string): code is ReasonCode {
  return Object.hasOwn(REASONS, code)
}

/** The reason behind a number (socket) or name (REST) of the original server. */
export function reasonOfResult(result: number | string): ReasonCode | null {
  const number = typeof result === 'string' ? (ResultCode as Record<string, number>)[result] : result
  return number === undefined ? null : (RESULT_REASONS[number] ?? null)
}

/** The reason behind a WebSocket close code; null for those that say nothing (1000, 1006 …). */
export function reasonOfClose(closeCode: number): ReasonCode | null {
  return CLOSE_REASONS[closeCode] ?? null
}

/** The extensions both sides know, each in the lower version. */
export function agreedExtensions(
  offered: Record<string, number> | undefined,
  known: Record<string, number>,
): Record<string, number> {
  const agreed: Record<string, number> = {}
  for (const [name, version] of Object.entries(offered ?? {})) {
    const ours = Object.hasOwn(known, name) ? known[name] : undefined
    if (ours !== undefined) agreed[name] = Math.min(version, ours)
  }
  return agreed
}
