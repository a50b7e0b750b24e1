import type { JournalEntry } from '@mosaic/client'
import fc from 'fast-check'
import { expect, test } from 'vitest'
import { about, dayOf, explained, found, joined, timeOf, toneOf, whatText } from './journalEntries'

const entry = (number: number, rest: Partial<JournalEntry> = {}): JournalEntry => ({
  number,
  at: '2026-03-01T14:03:07.120Z',
  what: 'lease.granted',
  who: 'Alice',
  subject: 'motion',
  code: '',
  message: '',
  ...rest,
})

test('what was read twice is shown once, newest first', () => {
  fc.assert(
    fc.property(fc.array(fc.nat(50)), fc.array(fc.nat(50)), (one, other) => {
      const numbers = joined(one.map((number) => entry(number)), other.map((number) => entry(number))).map(({ number }) => number)
      expect(numbers).toEqual([...new Set([...one, ...other])].sort((a, b) => b - a))
    }),
  )
})

test('a search finds every word, also in the sentence of a code', () => {
  const entries = [entry(1, { who: 'Bob', what: 'command_refused', code: 'lease.not_holder' }), entry(2)]
  expect(found(entries, 'bob somebody ELSE').map(({ number }) => number)).toEqual([1])
  expect(found(entries, 'motion')).toHaveLength(2)
  expect(found(entries, 'carol')).toEqual([])
  expect(found([entry(3, { account: '7d1c2f6e' }), entry(4)], '7d1c').map(({ number }) => number)).toEqual([3])
})

test('a topic leaves out the rest', () => {
  const entries = [entry(3, { what: 'command.refused' }), entry(2, { what: 'stop' }), entry(1, { what: 'command.accepted' })]
  expect(about(entries, 'control').map(({ number }) => number)).toEqual([2])
  expect(about(entries, 'refusals').map(({ number }) => number)).toEqual([3])
  expect(about(entries, 'everything')).toHaveLength(3)
})

test('what happened reads as words', () => {
  expect(whatText('command_refused')).toBe('Command refused')
  expect(whatText('lease.taken-over')).toBe('Lease taken over')
})

test('a code is explained', () => {
  expect(explained({ code: 'lease.taken_over' })).toContain('supervisor')
  expect(explained({ code: '' })).toBe('')
})

test.each([
  ['stop', '', 'bad'],
  ['stop.cleared', '', 'good'],
  ['lease', 'lease.taken_over', 'warn'],
  ['peer_connected', '', 'plain'],
])('%s %s is marked as %s', (what, code, tone) => expect(toneOf({ what, code })).toBe(tone))

test('day and time are those of the robot', () => {
  expect(timeOf('2026-03-01T14:03:07.120Z')).toBe('14:03:07')
  expect(dayOf('2026-03-01T14:03:07Z')).toBe('2026-03-01')
  expect(timeOf('soon')).toBe('soon')
})
