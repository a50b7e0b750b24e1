import fc from 'fast-check'
import { expect, test } from 'vitest'
import { resourceOf } from '../../src/index'
import { clearanceFor, type Standing } from '../../src/control/clearance'
import { LeaseTable } from '../../src/control/leaseTable'
import { entry } from '../bench'

const FREE = new LeaseTable().view('motion')
const standing = (more: Partial<Standing> = {}): Standing => ({
  availability: 'available',
  isStopped: false,
  me: null,
  lease: FREE,
  epoch: 0,
  ...more,
})

test.each([
  [undefined, null],
  [{}, null],
  [{ requires_lease: false, resource: 'arm' }, null],
  [{ requires_lease: 'yes' }, null],
  [{ requires_lease: true }, 'motion'],
  [{ requires_lease: true, resource: 'arm' }, 'arm'],
])('the resource of a connector whose safety says %j is %j', (safety, resource) => {
  expect(resourceOf(entry('x', safety === undefined ? {} : { safety }))).toBe(resource)
  expect(resourceOf(null)).toBeNull()
})

test('before the robot has said what it knows, what needs a lease is blocked', () => {
  const cmdVel = entry('cmd_vel', { safety: { requires_lease: true } })
  expect(clearanceFor(cmdVel, standing({ availability: 'unknown' })).block).toEqual({ code: 'lease.required' })
  expect(clearanceFor(null, standing({ availability: 'unknown' })).block).toBeNull()
})

test('of a lease with a name of its own it is said which one to take', () => {
  const arm = entry('arm', { safety: { requires_lease: true, resource: 'arm' } })
  expect(clearanceFor(arm, standing()).block).toEqual({ code: 'lease.required', message: 'Take control of arm.' })
})

test('a stop blocks what moves without a lease too, and nothing else', () => {
  const isStopped = true
  expect(clearanceFor(entry('horn', { safety: { timeout_s: 1 } }), standing({ isStopped })).block?.code).toBe('safety.stopped')
  expect(clearanceFor(entry('notes', { safety: {} }), standing({ isStopped })).block).toBeNull()
})

test('what a stop blocks leaves all the same: the robot must see that a program sends on', () => {
  const isStopped = true
  expect(clearanceFor(entry('horn', { safety: { timeout_s: 1 } }), standing({ isStopped })).leaves).toBe(true)
  const cmdVel = entry('cmd_vel', { safety: { requires_lease: true } })
  expect(clearanceFor(cmdVel, standing({ isStopped, epoch: 3 }))).toMatchObject({ epoch: 3, leaves: true })
})

test('what needs a lease leaves under an epoch or not at all, on a robot that knows leases', () => {
  const safety = fc.record({ requires_lease: fc.constant(true), resource: fc.constantFrom('motion', 'arm') })
  const anything = fc.record({
    availability: fc.constantFrom<Standing['availability']>('available', 'unknown'),
    isStopped: fc.boolean(),
    epoch: fc.nat(5),
  })
  fc.assert(
    fc.property(safety, anything, (limits, more) => {
      const { epoch, block, leaves } = clearanceFor(entry('x', { safety: limits }), standing(more))
      expect(leaves).toBe(more.epoch > 0)
      expect(epoch).toBe(more.epoch)
      expect(block === null).toBe(more.epoch > 0 && !more.isStopped)
      if (more.isStopped) expect(block?.code).toBe('safety.stopped')
    }),
  )
})
