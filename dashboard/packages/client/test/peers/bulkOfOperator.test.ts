import { describe, expect, test } from 'vitest'
import { OperatorBulkMachine, LOST_AFTER_MS, PING_PERIOD_MS, SETUP_TIMEOUT_MS, type LaneEffect, type LaneEvent } from '../../src/peers/bulkOfOperator'

/** The tables of `tests/machines/peers/test_bulk_of_operator.py`, for the twin. */
function laneAfter(...events: LaneEvent[]): OperatorBulkMachine {
  const lane = new OperatorBulkMachine(() => 1)
  for (const event of events) lane.handle(event, 0)
  return lane
}

function runUntil(lane: OperatorBulkMachine, endMs: number): [number, LaneEffect][] {
  const done: [number, LaneEffect][] = []
  while (lane.deadlineMs !== null && lane.deadlineMs <= endMs) {
    const atMs = lane.deadlineMs
    for (const effect of lane.handle({ type: 'deadlinePassed' }, atMs)) done.push([atMs, effect])
  }
  return done
}

describe('the second connection', () => {
  test('is made when it is wanted, and once', () => {
    const lane = new OperatorBulkMachine(() => 1)
    expect([lane.state, lane.deadlineMs]).toEqual(['none', null])
    expect(lane.handle({ type: 'wanted' }, 0)).toEqual([{ type: 'begin', attempt: 1 }])
    expect(lane.handle({ type: 'wanted' }, 0)).toEqual([])
  })

  test('is used from its first channel on, and pinged', () => {
    const lane = laneAfter({ type: 'wanted' })
    expect(lane.handle({ type: 'opened', attempt: 1 }, 1000)).toEqual([{ type: 'use' }])
    expect(lane.handle({ type: 'opened', attempt: 1 }, 1000)).toEqual([])
    expect(runUntil(lane, 1000 + PING_PERIOD_MS)).toEqual([[1000 + PING_PERIOD_MS, { type: 'ping' }]])
  })

  test('is waited for no longer than its time-out, and tried again ever more seldom', () => {
    const lane = laneAfter({ type: 'wanted' })
    const done = runUntil(lane, 900_000)
    const fallBack = { type: 'fallBack', attempt: 1, code: 'ice.timeout', tellsRobot: true }
    expect(done[0]).toEqual([SETUP_TIMEOUT_MS, fallBack])
    const begun = done.filter(([, { type }]) => type === 'begin').map(([atMs]) => atMs)
    const waits = begun.map((atMs, index) => atMs - (begun[index - 1] ?? 0) - SETUP_TIMEOUT_MS)
    expect(waits.slice(0, 4)).toEqual([3000, 6000, 12_000, 24_000])
    expect(Math.max(...waits)).toBe(120_000)
  })

  test('begins to count anew after it was up for long', () => {
    const lane = laneAfter({ type: 'wanted' }, { type: 'failed', attempt: 1, code: 'ice.failed' })
    expect(runUntil(lane, 3000)).toEqual([[3000, { type: 'begin', attempt: 2 }]])
    lane.handle({ type: 'opened', attempt: 2 }, 4000)
    for (let atMs = 5000; atMs <= 40_000; atMs += 1000) {
      runUntil(lane, atMs)
      lane.handle({ type: 'heard', attempt: 2 }, atMs)
    }
    lane.handle({ type: 'failed', attempt: 2, code: 'peer.lost' }, 40_000)
    expect(lane.deadlineMs).toBe(43_000)
  })

  test('ends in silence, but not because the page was frozen', () => {
    const silent = laneAfter({ type: 'wanted' }, { type: 'opened', attempt: 1 })
    const ends = runUntil(silent, LOST_AFTER_MS + PING_PERIOD_MS).map(([, effect]) => effect)
    expect(ends).toContainEqual({ type: 'fallBack', attempt: 1, code: 'peer.lost', tellsRobot: true })
    const frozen = laneAfter({ type: 'wanted' }, { type: 'opened', attempt: 1 })
    expect(frozen.handle({ type: 'deadlinePassed' }, 100_000)).toEqual([{ type: 'ping' }])
    expect(frozen.state).toBe('up')
  })

  test('hears nothing of an abandoned attempt, and does not repeat to the robot what it said', () => {
    const lane = laneAfter({ type: 'wanted' })
    const told = { type: 'failed', attempt: 1, code: 'lane.refused', isTold: true } as const
    expect(lane.handle(told, 0)).toEqual([{ type: 'fallBack', attempt: 1, code: 'lane.refused', tellsRobot: false }])
    expect(lane.handle({ type: 'opened', attempt: 1 }, 0)).toEqual([])
    expect(lane.handle({ type: 'deadlinePassed' }, 10)).toEqual([])
    expect([lane.state, lane.code]).toEqual(['failed', 'lane.refused'])
  })
})
