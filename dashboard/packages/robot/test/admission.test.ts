import fc from 'fast-check'
import { expect, test } from 'vitest'
import { Admission } from '../src/signaling/admission'

const offer = (rtcConnectionId: string) => ({ rtcConnectionId, sdpOffer: 'sdp' })
const candidate = { candidate: 'c', sdpMid: '0', sdpMLineIndex: 0 }

test('an offer takes a place with what came before it', () => {
  const admission = new Admission(2)
  const iceServers = [{ urls: ['stun:one'] }]
  admission.prepare({ rtcConnectionId: 'a', iceServers }, 0)
  expect(admission.candidate('a', candidate)).toBe(false)
  const admitted = admission.decide(offer('a'), [], 1)
  expect(admitted).toMatchObject({ type: 'start', iceServers, prepared: { candidates: [candidate] } })
  expect(admission.candidate('a', candidate)).toBe(true)
})

test('without fresh ICE servers those of the welcome count', () => {
  const admission = new Admission(2)
  const welcomed = [{ urls: ['stun:two'] }]
  expect(admission.decide(offer('a'), welcomed, 0)).toEqual({ type: 'start', prepared: null, iceServers: welcomed })
})

test('a full robot refuses, until somebody leaves', () => {
  const admission = new Admission(1)
  admission.decide(offer('a'), [], 0)
  expect(admission.isFull).toBe(true)
  expect(admission.decide(offer('b'), [], 0)).toMatchObject({ type: 'refuse', code: 'signal.robot_busy' })
  expect(admission.leave('a')).toBe(true)
  expect(admission.leave('a')).toBe(false)
  expect(admission.decide(offer('b'), [], 0).type).toBe('start')
})

test('a second offer of a running connection changes nothing', () => {
  const admission = new Admission(2)
  admission.decide(offer('a'), [], 0)
  expect(admission.decide(offer('a'), [], 0)).toEqual({ type: 'ignore' })
})

test('a preparation is forgotten after a minute', () => {
  const admission = new Admission(2)
  admission.prepare({ rtcConnectionId: 'a' }, 0)
  expect(admission.decide(offer('a'), [], 60_001)).toMatchObject({ prepared: null })
})

test('candidates of a peer are counted, before its offer and after it', () => {
  const admission = new Admission(2)
  admission.prepare({ rtcConnectionId: 'a' }, 0)
  for (let count = 0; count < 70; count += 1) admission.candidate('a', candidate)
  const admitted = admission.decide(offer('a'), [], 0)
  expect(admitted.type === 'start' && admitted.prepared?.candidates.length).toBe(64)
  expect(admission.candidate('a', candidate)).toBe(false)
})

test('whatever strangers send, what is kept has bounds', () => {
  const ids = fc.integer({ min: 0, max: 200 }).map(String)
  const step = fc.record({ what: fc.constantFrom('prepare', 'candidate', 'offer', 'leave'), id: ids })
  fc.assert(
    fc.property(fc.array(step, { maxLength: 400 }), (steps) => {
      const admission = new Admission(3)
      const running = new Set<string>()
      for (const [now, { what, id }] of steps.entries()) {
        if (what === 'prepare') admission.prepare({ rtcConnectionId: id }, now)
        if (what === 'candidate' && admission.candidate(id, candidate)) expect(running).toContain(id)
        if (what === 'leave') expect(admission.leave(id)).toBe(running.delete(id))
        if (what === 'offer' && admission.decide(offer(id), [], now).type === 'start') running.add(id)
        expect(running.size).toBeLessThanOrEqual(3)
        expect(admission.isFull).toBe(running.size === 3)
      }
    }),
  )
})
