import { expect, test } from 'vitest'
import { channelPlan } from '../../src/bindings/channelPlan'
import { entriesApart, entryFor } from '../../src/words/entriesApart'
import { CATALOGUE, entry, ROBOT } from '../bench'

const JOINTS = { type: 'object', properties: { names: { type: 'array' } } }
const ARM = entry('arm', {
  type: 'acme-arm',
  dataType: 'json-u2r',
  safety: { timeout_s: 0.5, requires_lease: true, resource: 'arm' },
  channels: [
    { label: 'arm', dataType: 'json-u2r', delivery: 'latest', schemaId: 'mosaic/JointTarget@1', safety: { requires_lease: true } },
    { label: 'arm_state', dataType: 'json-r2u', delivery: 'reliable', messageSchema: JOINTS, widget: 'time-plot' },
    { label: 'arm_talk', dataType: 'json-bi', delivery: 'reliable', sentSchema: JOINTS },
  ],
})
const ROBOTIC = { hash: 'h2', entries: [entry('battery'), ARM] }
const bare = (dataType: 'json-u2r' | 'json-r2u') => [{ label: 'x', dataType }]

test('channels that stand for themselves are connectors to an operator, each with what it says', () => {
  const apart = entriesApart(ROBOTIC)
  expect(apart.map(({ label, direction, delivery }) => [label, direction, delivery])).toEqual([
    ['battery', 'both', 'reliable'],
    ['arm', 'to-robot', 'latest'],
    ['arm_state', 'to-operator', 'reliable'],
    ['arm_talk', 'both', 'reliable'],
  ])
  expect(apart[2]).toMatchObject({ type: 'acme-arm', widget: 'time-plot', messageSchema: JOINTS, channels: [{ label: 'arm_state' }] })
  expect(apart[2]?.safety).toBeUndefined()
})

test('they are the same ones for the same catalogue, so that nothing is drawn anew', () => {
  expect(entriesApart(ROBOTIC)[1]).toBe(entriesApart({ entries: [...ROBOTIC.entries] })[1])
})

test('channels that are parts of their connector stay together', () => {
  expect(entriesApart(CATALOGUE)).toEqual(CATALOGUE.entries)
})

test('a channel is found by its label, and a whole connector by one that no channel has', () => {
  expect(entryFor(ROBOTIC, 'arm')).toMatchObject({ dataType: 'json-u2r', safety: { requires_lease: true } })
  expect(entryFor(ROBOTIC, 'arm_state')?.dataType).toBe('json-r2u')
  expect(entryFor(CATALOGUE, 'link')?.channels).toHaveLength(2)
  expect(entryFor(ROBOTIC, 'leg')).toBeUndefined()
})

test.each([
  ['arm', 'json-u2r', 'latest'],
  ['arm_state', 'json-r2u', 'reliable'],
] as const)('a store of %s gets that one channel, delivered as it says', (connectorId, dataType, delivery) => {
  const plan = channelPlan({ robotId: ROBOT, connectorId }, { catalogue: ROBOTIC, isOriginal: false, bare: bare(dataType) })
  expect(plan).toMatchObject({ type: 'channels', channels: [{ label: connectorId, dataType }], delivery })
})

test('a label that is none gets the nearest channel told', () => {
  const plan = channelPlan({ robotId: ROBOT, connectorId: 'arm_stat' }, { catalogue: ROBOTIC, isOriginal: false, bare: bare('json-r2u') })
  expect(plan).toMatchObject({ type: 'mismatch', state: { nearest: 'arm_state' } })
})
