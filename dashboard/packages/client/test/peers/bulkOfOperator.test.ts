import { describe, expect, test } from 'vitest'
import { OperatorBulkMachine, LOST_AFTER_MS, PING_PERIOD_MS, SETUP_TIMEOUT_MS, type BulkEffect, type BulkEvent } from '../../src/peers/bulkOfOperator'

/** The tables of `tests/machines/peers/test_bulk_of_operator.py`, for the twin. */
function bulkAfter(...events: BulkEvent[]): OperatorBulkMachine {
  const bulk = new OperatorBulkMachine(() => 1)
  for (const event of events) bulk.handle(event, 0)
  return bulk
}

function runUntil(bulk: OperatorBulkMachine, endMs: number): [number, BulkEffect][] {
  const done: [number, BulkEffect][] = []
  while (bulk.deadlineMs !== null && bulk.deadlineMs <= endMs) {
    const atMs = bulk.deadlineMs
    for (const effect of bulk.handle({ type: 'deadlinePassed' }, atMs)) done.push([atMs, effect])
  }
  return done
}

describe('the second connection', () => {
  test('is made when it is wanted, and once', () => {
    const bulk = new OperatorBulkMachine(() => 1)
    expect([bulk.state, bulk.deadlineMs]).toEqual(['none', null])
    expect(bulk.handle({ type: 'wanted' }, 0)).toEqual([{ type: 'begin', attempt: 1 }])
    expect(bulk.handle({ type: 'wanted' }, 0)).toEqual([])
  })

  test('is used from its first channel on, and pinged', () => {
    const bulk = bulkAfter({ type: 'wanted' })
    expect(bulk.handle({ type: 'opened', attempt: 1 }, 1000)).toEqual([{ type: 'use' }])
    expect(bulk.handle({ type: 'opened', attempt: 1 }, 1000)).toEqual([])
    expect(runUntil(bulk, 1000 + PING_PERIOD_MS)).toEqual([[1000 + PING_PERIOD_MS, { type: 'ping' }]])
  })

  test('is waited for no longer than its time-out, and tried again ever more seldom', () => {
    const bulk = bulkAfter({ type: 'wanted' })
    const done = runUntil(bulk, 900_000)
    const fallBack = { type: 'fallBack', attempt: 1, code: 'ice.timeout', tellsRobot: true }
    expect(done[0]).toEqual([SETUP_TIMEOUT_MS, fallBack])
    const begun = done.filter(([, { type }]) => type === 'begin').map(([atMs]) => atMs)
    const waits = begun.map((atMs, index) => atMs - (begun[index - 1] ?? 0) - SETUP_TIMEOUT_MS)
    expect(waits.slice(0, 4)).toEqual([3000, 6000, 12_000, 24_000])
    expect(Math.max(...waits)).toBe(120_000)
  })

  test('begins to count anew after it was up for long', () => {
    const bulk = bulkAfter({ type: 'wanted' }, { type: 'failed', attempt: 1, code: 'ice.failed' })
    expect(runUntil(bulk, 3000)).toEqual([[3000, { type: 'begin', attempt: 2 }]])
    bulk.handle({ type: 'opened', attempt: 2 }, 4000)
    for (let atMs = 5000; atMs <= 40_000; atMs += 1000) {
      runUntil(bulk, atMs)
      bulk.handle({ type: 'heard', attempt: 2 }, atMs)
    }
    bulk.handle({ type: 'failed', attempt: 2, code: 'peer.lost' }, 40_000)
    expect(bulk.deadlineMs).toBe(43_000)
  })

  test('ends in silence, but not because the page was frozen', () => {
    const silent = bulkAfter({ type: 'wanted' }, { type: 'opened', attempt: 1 })
    const ends = runUntil(silent, LOST_AFTER_MS + PING_PERIOD_MS).map(([, effect]) => effect)
    expect(ends).toContainEqual({ type: 'fallBack', attempt: 1, code: 'peer.lost', tellsRobot: true })
    const frozen = bulkAfter({ type: 'wanted' }, { type: 'opened', attempt: 1 })
    expect(frozen.handle({ type: 'deadlinePassed' }, 100_000)).toEqual([{ type: 'ping' }])
    expect(frozen.state).toBe('up')
  })

  test('hears nothing of an abandoned attempt, and does not repeat to the robot what it said', () => {
    const bulk = bulkAfter({ type: 'wanted' })
    const told = { type: 'failed', attempt: 1, code: 'bulk.refused', isTold: true } as const
    expect(bulk.handle(told, 0)).toEqual([{ type: 'fallBack', attempt: 1, code: 'bulk.refused', tellsRobot: false }])
    expect(bulk.handle({ type: 'opened', attempt: 1 }, 0)).toEqual([])
    expect(bulk.handle({ type: 'deadlinePassed' }, 10)).toEqual([])
    expect([bulk.state, bulk.code]).toEqual(['failed', 'bulk.refused'])
  })
})
