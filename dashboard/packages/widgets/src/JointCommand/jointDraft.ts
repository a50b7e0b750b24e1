/** A target for joints as a person sets it: only what was touched is sent, the others follow where the joints stand. Pure. */
import type { Joint } from '../Joints/joints'

/** As near as a servo stands to where it was sent, in rad or m. */
const THERE = 0.02
/** A time that is over would not be one. */
const SHORTEST_S = 0.05

/** By the joint's name; what is not here was not touched. */
export type JointDraft = Readonly<Record<string, number>>

/** The joints that a target may name: those that are reported, then those that limits name. */
export function knownNames(reported: readonly Joint[], limited: readonly string[]): string[] {
  return [...new Set([...reported.map(({ name }) => name), ...limited])]
}

/** What was set of these joints: what is shown no more is not sent either. */
export function ofNames(draft: JointDraft, names: readonly string[]): JointDraft {
  return Object.fromEntries(Object.entries(draft).filter(([name]) => names.includes(name)))
}

/** The message, or null where nothing was touched. */
export function targetOf(draft: JointDraft, durationS: number | null): object | null {
  const names = Object.keys(draft)
  if (names.length === 0) return null
  const positions = names.map((name) => draft[name])
  return durationS === null ? { names, positions } : { names, positions, duration_s: durationS }
}

/** The message so long after the first one: what is left of its time, so that saying it again slows nothing down. */
export function targetAfter(draft: JointDraft, durationS: number | null, elapsedS: number): object {
  return { ...targetOf(draft, durationS === null ? null : Math.max(SHORTEST_S, durationS - elapsedS)) }
}

/** Whether all joints are reported where they shall be. */
export function isThere(draft: JointDraft, reported: readonly Joint[]): boolean {
  return Object.entries(draft).every(([name, goal]) => {
    const position = reported.find((joint) => joint.name === name)?.position ?? null
    return position !== null && Math.abs(position - goal) <= THERE
  })
}

/** A number that a person typed; null for nothing and for what is none, or not above `above`. */
export function typedNumber(text: string, above = -Infinity): number | null {
  const value = Number(text.replace(',', '.'))
  return text.trim() === '' || !Number.isFinite(value) || value <= above ? null : value
}
