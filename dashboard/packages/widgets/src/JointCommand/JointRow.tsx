import type { CatalogueEntry } from '@mosaic/client'
import { rangeOf, sliderRange, type Joint } from '../Joints/joints'
import type { JointDraft } from './jointDraft'
import { NumberRow } from './NumberRow'
import { SliderRow } from './SliderRow'

export interface JointRowProps {
  name: string
  entry: CatalogueEntry
  reported: readonly Joint[]
  draft: JointDraft
  onDraft: (change: (before: JointDraft) => JointDraft) => void
}

/** A joint's target: a slider from where it stands. Where that is unknown a slider would begin at a made-up place, and
 *  one press would send the joint there: then a number is typed. */
export function JointRow({ name, entry, reported, draft, onDraft }: JointRowProps) {
  const range = rangeOf(entry.safety, `positions.${name}`)
  const set = (position: number) => onDraft((before) => ({ ...before, [name]: position }))
  const position = reported.find((joint) => joint.name === name)?.position ?? null
  if (position === null) {
    const clear = () => onDraft((before) => Object.fromEntries(Object.entries(before).filter(([one]) => one !== name)))
    return <NumberRow name={name} unit="rad" {...range} value={draft[name] ?? null} onChange={(value) => (value === null ? clear() : set(value))} />
  }
  const value = draft[name] ?? position
  return <SliderRow {...{ name, value }} {...sliderRange(range, value)} isTouched={name in draft} unit="rad" onChange={set} />
}
