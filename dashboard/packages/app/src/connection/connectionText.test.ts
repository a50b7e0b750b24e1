import type { ConnectionPhase } from '@mosaic/client'
import { describe, expect, test } from 'vitest'
import { bulkConnectionText, connectionText, formattedRoundTrip } from './connectionText'

describe('the badge', () => {
  test.each<ConnectionPhase>(['idle', 'connecting', 'connected', 'reconnecting', 'failed', 'closed'])('%s has a text', (phase) => {
    expect(connectionText({ phase, roundTripMs: null }).text).not.toBe('')
  })

  test('a failure has its reason, its cure and a way on', () => {
    const text = connectionText({ phase: 'failed', code: 'ice.timeout', roundTripMs: null })
    expect(text.reason).toContain('network path')
    expect(text.cure).toContain('TURN')
    expect(text.canRetry).toBe(true)
  })

  test('a robot that has somebody else may be free soon, and the page says for how long it tries', () => {
    const trying = connectionText({ phase: 'connecting', code: 'signal.robot_busy', roundTripMs: null })
    expect(trying.cure).toContain('up to 45 s. This page keeps trying.')
    const failed = connectionText({ phase: 'failed', code: 'signal.robot_busy', roundTripMs: null })
    expect(failed.cure).toMatch(/up to 45 s\.$/)
    expect(failed.canRetry).toBe(true)
  })

  test('a robot of which nothing can be known, or that is not there, did not fail', () => {
    const failed = { phase: 'failed', code: 'signal.robot_offline', roundTripMs: null } as const
    expect(connectionText(failed).text).toBe('Failed')
    expect(connectionText(failed, { isOnline: false }).text).toBe('Offline')
    expect(connectionText(failed, { isOnline: false, isServerAway: true }).text).toBe('No server')
    expect(connectionText({ ...failed, phase: 'connecting' }, { isServerAway: true }).text).toBe('No server')
    expect(connectionText({ ...failed, phase: 'connecting' }, { isOnline: false }).text).toBe('Connecting')
    expect(connectionText({ ...failed, phase: 'connected' }, { isServerAway: true }).text).toBe('Connected')
  })

  test('says where bulk data goes, and why not over a connection of its own', () => {
    expect(bulkConnectionText({ phase: 'none' })).toBe('')
    expect(bulkConnectionText({ phase: 'up' })).toContain('of its own')
    expect(bulkConnectionText({ phase: 'failed', code: 'ice.timeout' })).toContain('No network path')
  })

  test.each([
    [null, '– ms'],
    [1.26, '1.3 ms'],
    [42.4, '42 ms'],
  ])('a round trip of %s is %s', (value, text) => {
    expect(formattedRoundTrip(value)).toBe(text)
  })
})
