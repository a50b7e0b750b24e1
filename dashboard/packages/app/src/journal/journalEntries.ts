/** What is done with entries of a robot's journal before they are shown: joined, found, put into words. Pure. */
import { reasonOf, type JournalEntry } from '@mosaic/client'

/** All entries once, newest first. */
export function joined(known: readonly JournalEntry[], read: readonly JournalEntry[]): JournalEntry[] {
  const byNumber = new Map([...known, ...read].map((entry) => [entry.number, entry]))
  return [...byNumber.values()].sort((one, other) => other.number - one.number)
}

/** What a reader may want to see only. */
export type JournalTopic = 'everything' | 'control' | 'refusals'

/** Of leases and stops; of what was refused; or all. */
export function about(entries: readonly JournalEntry[], topic: JournalTopic): readonly JournalEntry[] {
  if (topic === 'everything') return entries
  const pattern = topic === 'control' ? /^(lease|stop)/ : /refus|deni/
  return entries.filter(({ what }) => pattern.test(what))
}

/** Entries that hold every word of the search, in whatever place. */
export function found(entries: readonly JournalEntry[], search: string): JournalEntry[] {
  const words = search.toLowerCase().split(/\s+/).filter(Boolean)
  return entries.filter((entry) => {
    const text = `${entry.at} ${whatText(entry.what)} ${entry.who} ${entry.account ?? ''} ${entry.subject} ${entry.code} ${entry.message} ${explained(entry)}`.toLowerCase()
    return words.every((word) => text.includes(word))
  })
}

/** `lease.granted` or `command_refused` as words. */
export function whatText(what: string): string {
  const words = what.replace(/[._-]+/g, ' ').trim()
  return words.charAt(0).toUpperCase() + words.slice(1)
}

/** The reason code in a sentence; empty where there is no code. */
export function explained({ code }: Pick<JournalEntry, 'code'>): string {
  return code === '' ? '' : reasonOf(code).sentence
}

export type EntryTone = 'plain' | 'good' | 'warn' | 'bad'

/** How an entry is marked: stops and refusals must be found at a glance. */
export function toneOf({ what, code }: Pick<JournalEntry, 'what' | 'code'>): EntryTone {
  if (/forbidden/.test(code)) return 'warn'
  if (/clear|grant/.test(what)) return 'good'
  if (/stop/.test(what)) return 'bad'
  return /refus|deni|taken|preempt|expire|lost|fail/.test(`${what} ${code}`) ? 'warn' : 'plain'
}

/** `14:03:07` of an ISO time, as the robot's clock says; the day is shown where it changes. */
export function timeOf(at: string): string {
  return /T(\d\d:\d\d:\d\d)/.exec(at)?.[1] ?? at
}

export function dayOf(at: string): string {
  return /^\d{4}-\d\d-\d\d/.exec(at)?.[0] ?? ''
}
