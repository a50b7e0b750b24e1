/** Findings of the operator's half, with the same codes, sentences and cures as those of `mosaic doctor`. */
import { REASONS, type Finding, type ReasonCode } from '@mosaic/protocol'

export type Facts = Record<string, unknown>

export function passed(check: string, sentence: string, facts: Facts = {}): Finding {
  return { check, status: 'ok', code: 'check.ok', sentence, cure: '', facts }
}

/** Nothing is wrong, and yet worth knowing. */
export function told(check: string, code: ReasonCode): Finding {
  const { sentence, cure } = REASONS[code]
  return { check, status: 'ok', code, sentence: `${sentence} ${cure}`, cure: '', facts: {} }
}

export function skipped(check: string, sentence: string): Finding {
  return { check, status: 'skipped', code: 'check.skipped', sentence, cure: '', facts: {} }
}

export interface Problem {
  sentence?: string
  cure?: string
  facts?: Facts
}

export function failed(check: string, code: ReasonCode, problem: Problem = {}): Finding {
  return problemOf('fail', check, code, problem)
}

export function warned(check: string, code: ReasonCode, problem: Problem = {}): Finding {
  return problemOf('warn', check, code, problem)
}

function problemOf(status: 'fail' | 'warn', check: string, code: ReasonCode, { sentence, cure, facts }: Problem): Finding {
  const known = REASONS[code]
  return { check, status, code, sentence: sentence ?? known.sentence, cure: cure ?? known.cure, facts: facts ?? {} }
}
