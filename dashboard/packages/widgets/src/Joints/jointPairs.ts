/** Which report tells where the joints of a command stand: a robot may have several arms, also with joints of equal
 *  names. Where it can't be known, none does: the place of another arm is worse than no place. Pure. */
import { messages, siblingsOf, type CatalogueEntry } from '@mosaic/client'
import { arrivingId } from '../stores/useEntries'
import { limitedNames, type Joint } from './joints'

type Entries = readonly CatalogueEntry[]
/** What the reports said last, by their labels. */
export type Heard = Readonly<Record<string, readonly Joint[]>>

const { JointState, JointTarget } = messages.SCHEMA_IDS
const isTarget = (entry: CatalogueEntry) => entry.schemaId === JointTarget && entry.direction !== 'to-operator'
const isReport = (entry: CatalogueEntry) => arrivingId(entry) === JointState

/** The joints that a command is known to take. */
export function takenNames(target: CatalogueEntry): readonly string[] {
  return target.itemNames ?? limitedNames(target.safety, 'positions')
}

/** The reports that may be of this command: those of its own connector, else those that belong to no other command. */
export function reportsFor(entries: Entries, target: CatalogueEntry): Entries {
  const own = siblingsOf({ entries }, target).filter(isReport)
  if (own.length > 0) return own
  const isFree = (report: CatalogueEntry) => !siblingsOf({ entries }, report).some(isTarget)
  const free = entries.filter((entry) => isReport(entry) && isFree(entry))
  // Of a command whose joints nobody names, only the one report of the one arm tells.
  const isOnlyArm = free.length === 1 && entries.filter(isTarget).length === 1
  return takenNames(target).length > 0 || isOnlyArm ? free : []
}

/** The joints of the report that fits, in its order; none where no report does, or two do equally. */
export function reportedJoints(reports: Entries, heard: Heard, target: CatalogueEntry): readonly Joint[] {
  const names = takenNames(target)
  const ranked = reports
    .map((report) => ({ joints: heard[report.label] ?? [], near: sharedWords(report.label, target.label), isOwn: isSameConnector(report, target) }))
    .map((one) => ({ ...one, told: names.filter((name) => one.joints.some((joint) => joint.name === name)).length }))
    .filter(({ joints, told, isOwn }) => joints.length > 0 && (isOwn ? told > 0 || names.length === 0 : told === names.length))
    .sort((a, b) => b.told - a.told || b.near - a.near)
  const [best, next] = ranked
  if (best === undefined || (next?.told === best.told && next.near === best.near)) return []
  return best.isOwn && target.itemNames === undefined ? best.joints : onlyNamed(best.joints, names)
}

/** The command that takes a joint of this report: of the report's own connector, else the one that is called most alike. */
export function targetOfJoint(entries: Entries, report: CatalogueEntry, name: string): CatalogueEntry | undefined {
  const own = siblingsOf({ entries }, report).filter(isTarget)
  const near = (target: CatalogueEntry) => sharedWords(report.label, target.label)
  const targets = (own.length > 0 ? own : entries.filter(isTarget)).toSorted((a, b) => near(b) - near(a))
  return targets.find((target) => takenNames(target).includes(name)) ?? (targets.length === 1 ? targets[0] : undefined)
}

const isSameConnector = (a: CatalogueEntry, b: CatalogueEntry) => a.connector !== undefined && a.connector === b.connector

function onlyNamed(joints: readonly Joint[], names: readonly string[]): readonly Joint[] {
  return names.length === 0 ? joints : joints.filter(({ name }) => names.includes(name))
}

/** How many words two labels begin with alike: `left_arm` and `left_joints` one. */
function sharedWords(a: string, b: string): number {
  const [ours, theirs] = [a, b].map((label) => label.toLowerCase().split(/[^\p{L}\p{N}]+/u))
  const end = ours?.findIndex((word, index) => word !== theirs?.[index]) ?? 0
  return end < 0 ? (ours?.length ?? 0) : end
}
