/** What the page says about who commands, about the stop, and about what limits the speed: pure, in whole sentences. */
import { reasonOf, resourceOf, type Availability, type Catalogue, type LeaseView, type PeerView, type Refusal, type Role, type SafetyLimit, type StopReport, type ZerosReport } from '@mosaic/client'
import { formattedMs } from '../stores/age'
import { wholeSentence } from '../stores/wholeSentence'

/** What the robot refused: the gate that did, why, what to do, and of how many alike it speaks. */
export function refusalText({ code, gate, message, count = 1 }: Refusal): string {
  const { sentence, cure } = reasonOf(code)
  const said = wholeSentence(message ?? sentence)
  const more = count > 1 ? `(and ${count - 1} more)` : ''
  return [`Refused${gate === undefined ? '' : ` at the gate ‘${gate}’`}: ${said}`, cure, more].filter(Boolean).join(' ')
}

export const NOT_CERTIFIED = 'This stop travels over the network. It is not a certified emergency stop.'

const ROLES: Record<Role, string> = { observer: 'observer', operator: 'operator', supervisor: 'supervisor' }

export function roleText(role: Role): string {
  return ROLES[role]
}

type Named = Pick<PeerView, 'name' | 'isPerson' | 'isOriginal'> & { isMe?: boolean }

/** How somebody is called on the page. */
export function nameOf(peer: Named | null | undefined): string {
  if (peer == null) return 'Nobody'
  if (peer.isMe === true) return 'You'
  if (peer.name !== '') return peer.name
  if (peer.isOriginal) return 'An original dashboard'
  return peer.isPerson ? 'Somebody' : 'A program'
}

/** How far the stop has come that was pressed on this page. */
export function stopReportText({ phase, copies, safeMs, acknowledgedMs, zeros }: Omit<StopReport, 'id' | 'reason' | 'receivedMs'>): string {
  const afterMs = safeMs ?? acknowledgedMs
  const measured = afterMs === null ? '' : formattedMs(afterMs)
  switch (phase) {
    case 'sending':
      return copies === 0 ? 'Not stopped: this page is not connected, so nothing was sent yet' : 'Stopping…'
    case 'acknowledged':
      return `The robot has your stop${acknowledgedMs === null ? '' : ` after ${formattedMs(acknowledgedMs)}`}; its safe action is still running`
    case 'safe':
      return measured === '' ? 'Stopped' : safeMs === null ? `Stopped, confirmed after ${measured}` : `Stopped in ${measured}`
    case 'unconfirmed':
      return copies === 0 ? 'Not stopped: this page is not connected, so nothing was sent' : 'The robot did not confirm the stop'
    case 'unavailable':
      return zerosText(zeros)
  }
}

/** What was done in place of a stop; only what left the page counts. */
function zerosText({ sent, unsent }: ZerosReport = { sent: [], unsent: [] }): string {
  const named = (labels: readonly string[]) => labels.map((label) => `‘${label}’`).join(', ')
  const missed = unsent.length === 0 ? '' : `; nothing was sent to ${named(unsent)}, whose channel is not open`
  if (sent.length > 0) return `This robot knows no stop; zeros were sent to ${named(sent)}${missed}`
  return `Not stopped: this robot knows no stop${unsent.length === 0 ? ', and no drive of it is known here: nothing was sent' : missed}`
}

/** What the stop button does. `restable`: the connectors that get zeros where the robot knows no stop. */
export function stopHint(availability: Availability, restable: readonly string[]): string {
  if (availability !== 'unavailable') return 'The robot stands still until somebody clears it.'
  if (restable.length === 0) return 'This robot has no stop, and no drive of it is known here: this button can’t stop it.'
  return `This robot knows no stop: its drive (${restable.join(', ')}) is sent zeros, and it moves again with the next command.`
}

/** Why this page may not stop the robot; empty where it may. */
export function stopTakenText(me: PeerView | null): string {
  return me?.mayStop === false ? `${takerOf(me)} took from you the right to stop this robot. Tell a supervisor what you see.` : ''
}

/** Who took the right to say stop; robots of before did not tell. */
export function takerOf({ stopRightBy = '' }: Pick<PeerView, 'stopRightBy'>): string {
  return stopRightBy === '' ? 'A supervisor' : stopRightBy
}

/** What an observer may do. */
export function observerText(me: PeerView): string {
  return `Your role is observer: you may watch${me.mayStop === false ? '' : ', and stop'}`
}

/** `Since 14:03:07, for 2 min`; empty while it is not known. */
export function sinceText(sinceMs: number | null, nowMs: number): string {
  if (sinceMs === null) return ''
  const at = new Intl.DateTimeFormat(undefined, { timeStyle: 'medium' }).format(sinceMs)
  const minutes = Math.floor(Math.max(0, nowMs - sinceMs) / 60_000)
  return minutes < 1 ? `Since ${at}` : `Since ${at}, for ${minutes < 60 ? `${minutes} min` : `${Math.floor(minutes / 60)} h`}`
}

/** Who may clear a stop, and whether this page may. */
export function clearing(me: PeerView | null, leases: Readonly<Record<string, LeaseView>>): { mayClear: boolean; text: string } {
  if (me === null) return { mayClear: false, text: 'Waiting for the robot.' }
  const views = Object.values(leases)
  if (me.role === 'supervisor' || views.some(({ isMine }) => isMine)) return { mayClear: true, text: '' }
  const holder = views.find(({ state }) => state === 'other')?.holder
  if (holder?.isPerson === true) return { mayClear: false, text: `${nameOf(holder)}, who has control, or a supervisor can clear it.` }
  if (me.role === 'observer') return { mayClear: false, text: 'Whoever has control, or a supervisor, can clear it.' }
  return { mayClear: false, text: 'Take control to clear it; a supervisor can as well.' }
}

export interface LimitText {
  tone: 'slowed' | 'held'
  /** `60 %`. */
  share: string
  title: string
  why: string
}

const CAUSES = {
  rtt: (value: number | undefined) => `the link is slow${value === undefined ? '' : ` (round trip ${formattedMs(value)})`}`,
  loss: (value: number | undefined) => `the link loses commands${value === undefined ? '' : ` (${Math.round(value * 100)} %)`}`,
  picture: (value: number | undefined) =>
    value === undefined ? 'no picture is shown' : `the picture is old (${formattedMs(value)})`,
}

/** How the robot limits the speed, and why; null where it does not. */
export function limitText(limit: SafetyLimit | null): LimitText | null {
  if (limit === null || limit.factor >= 1) return null
  const causes = [...limit.causes].filter(({ factor }) => factor < 1).sort((one, other) => one.factor - other.factor)
  const share = `${Math.round(limit.factor * 100)} %`
  const why = causes.map(({ cause, value }) => CAUSES[cause](value ?? undefined)).join('; ')
  const isHeld = limit.factor <= 0
  return { tone: isHeld ? 'held' : 'slowed', share, title: isHeld ? 'Held still by the robot' : `Slowed to ${share}`, why }
}

/** What stands on a lease's button. */
export interface LeaseText {
  label: string
  /** What a press does: ask at once, open the dialog, give back, withdraw; null: nothing. */
  action: 'take' | 'ask' | 'release' | 'withdraw' | null
  hint: string
}

export function leaseText(lease: LeaseView, me: PeerView | null): LeaseText {
  const holder = nameOf(lease.holder)
  if (lease.state === 'mine') return { label: 'You have control', action: 'release', hint: 'Give control back' }
  if (lease.request !== null) return waitingText(lease)
  if (me?.role === 'observer') {
    const label = lease.state === 'free' ? 'Observing' : `${holder} has control`
    return { label, action: null, hint: `${observerText(me)}. An administrator can grant another role.` }
  }
  if (lease.state === 'free') return { label: 'Take control', action: 'take', hint: 'Nobody has control' }
  return { label: `${holder} has control`, action: 'ask', hint: lease.holder?.isPerson === true ? 'Ask for control' : 'A program drives; you may take control from it' }
}

function waitingText({ request, holder }: LeaseView): LeaseText {
  const place = (request?.place ?? 0) > 1 ? `, you are number ${request?.place ?? 0}` : ''
  const label = request?.phase === 'queued' ? `Waiting for ${nameOf(holder)}` : 'Asking…'
  return { label, action: 'withdraw', hint: `Your request waits for an answer${place}. Press to withdraw it.` }
}

/** A reason code in a sentence, with what the robot adds. */
export function whyText({ code, message }: { code: string; message?: string | undefined }): string {
  const { sentence } = reasonOf(code)
  return message === undefined || message === '' || message === sentence ? sentence : `${sentence} “${message}”`
}

/** A resource as a word: `arm` is named, the usual `motion` goes without saying. */
export function resourceSuffix(resource: string): string {
  return resource === 'motion' ? '' : ` of ${resource}`
}

/**
 * The resources that have a button: every robot knows `motion`, also one whose connectors need another lease alone; it is
 * shown there only while somebody has it or waits for it.
 */
export function shownLeases(leases: Readonly<Record<string, LeaseView>>, catalogue: Catalogue | null): string[] {
  const needed = new Set(catalogue?.entries.map(resourceOf))
  const resources = Object.keys(leases)
  const isOther = resources.some((resource) => resource !== 'motion' && needed.has(resource))
  const isIdle = ({ state, request, queue }: LeaseView) => state === 'free' && request === null && queue.length === 0
  return resources.filter((resource) => {
    const lease = leases[resource]
    return resource !== 'motion' || needed.has(resource) || !isOther || (lease !== undefined && !isIdle(lease))
  })
}
