/** Findings by the part of the system that they are about, in a fixed order whatever came first. */
import type { Finding } from '@mosaic/client'

const TITLES: readonly (readonly [string, string])[] = [
  ['browser', 'This browser'],
  ['network', 'Network'],
  ['server', 'Server'],
  ['ice', 'STUN, TURN, NAT'],
]

export interface FindingGroup {
  title: string
  findings: readonly Finding[]
}

export function groupedFindings(findings: readonly Finding[]): FindingGroup[] {
  return TITLES.map(([name, title]) => ({
    title,
    findings: findings.filter(({ check }) => check.startsWith(`${name}.`)),
  })).filter((group) => group.findings.length > 0)
}

/** What matters most for a connection; a microphone matters to few. */
const URGENCY = ['server', 'network', 'ice', 'browser']

/** The first thing to do something about; null where nothing is wrong. */
export function worst(findings: readonly Finding[]): Finding | null {
  const urgency = ({ check }: Finding) => URGENCY.indexOf(check.split('.')[0] ?? '')
  const first = (status: Finding['status']) =>
    findings.filter((finding) => finding.status === status).sort((one, other) => urgency(one) - urgency(other))[0]
  return first('fail') ?? first('warn') ?? null
}

/** For the clipboard; the same keys as `mosaic doctor --json`. */
export function findingsJson(findings: readonly Finding[]): string {
  const ok = !findings.some(({ status }) => status === 'fail')
  return JSON.stringify({ version: 1, ok, userAgent: navigator.userAgent, findings }, null, 2)
}
