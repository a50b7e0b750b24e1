// @vitest-environment happy-dom
import type { Finding } from '@mosaic/client'
import { expect, test } from 'vitest'
import { findingsJson, groupedFindings, worst } from './groupedFindings'

function finding(check: string, status: Finding['status']): Finding {
  return { check, status, code: 'check.ok', sentence: `${check}.`, cure: '', facts: {} }
}

test('groups come in a fixed order, whatever was found first', () => {
  const groups = groupedFindings([finding('ice.nat', 'ok'), finding('server.http', 'ok'), finding('browser.webrtc', 'ok')])
  expect(groups.map(({ title }) => title)).toEqual(['This browser', 'Server', 'STUN, TURN, NAT'])
})

test('a failure comes before a warning, and nothing wrong is nothing to do', () => {
  const found = [finding('a.a', 'ok'), finding('b.b', 'warn'), finding('c.c', 'fail')]
  expect(worst(found)?.check).toBe('c.c')
  expect(worst(found.slice(0, 2))?.check).toBe('b.b')
  expect(worst(found.slice(0, 1))).toBeNull()
  expect(worst([finding('browser.microphone', 'warn'), finding('ice.nat', 'warn')])?.check).toBe('ice.nat')
})

test('what is copied has the keys of the command line', () => {
  expect(JSON.parse(findingsJson([finding('a.a', 'fail')]))).toMatchObject({ version: 1, ok: false, findings: [{ check: 'a.a' }] })
})
