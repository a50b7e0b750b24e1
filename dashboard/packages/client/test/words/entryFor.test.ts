import { expect, test } from 'vitest'
import { channelPlan } from '../../src/bindings/channelPlan'
import { mediaLines } from '../../src/bindings/mediaLines'
import { entryFor } from '../../src/words/entryFor'
import { siblingsOf } from '../../src/words/siblingsOf'
import { CATALOGUE, entry, ROBOT } from '../bench'

const own = (label: string, more: Parameters<typeof entry>[1]) => entry(label, { type: 'acme-arm', ...more })
const ARM = own('arm', { dataType: 'json-u2r', delivery: 'latest', safety: { requires_lease: true }, channels: [{ label: 'arm', dataType: 'json-u2r' }] })
const STATE = own('arm_state', { dataType: 'json-r2u', delivery: 'reliable', channels: [{ label: 'arm_state', dataType: 'json-r2u' }] })
const EYES = ['arm_left', 'arm_right'].map((label) => own(label, { dataType: 'media', kind: 'video', channels: [] }))
const EAR = own('arm_ear', { dataType: 'media', kind: 'audio', direction: 'to-operator', channels: [] })
const catalogue = { hash: 'h2', entries: [entry('battery'), ARM, STATE, EAR, ...EYES] }
const bare = (dataType: 'json-u2r' | 'json-r2u') => [{ label: 'x', dataType }]

test('each handler of a connector is found by its own label, and parts by that of their connector', () => {
  expect(entryFor(catalogue, 'arm')).toBe(ARM)
  expect(entryFor(catalogue, 'arm_state')).toBe(STATE)
  expect(entryFor(CATALOGUE, 'link')?.channels).toHaveLength(2)
  expect(entryFor(catalogue, 'leg')).toBeNull()
  expect(entryFor(null, 'arm')).toBeNull()
})

test.each([
  ['arm', 'json-u2r', 'latest'],
  ['arm_state', 'json-r2u', 'reliable'],
] as const)('a store of %s gets that one channel, delivered as it says', (connectorId, dataType, delivery) => {
  const plan = channelPlan({ robotId: ROBOT, connectorId }, { catalogue, isOriginal: false, bare: bare(dataType) })
  expect(plan).toMatchObject({ type: 'channels', channels: [{ label: connectorId, dataType }], delivery })
})

test('each camera of a connector gets a line of its own, and so does its microphone', () => {
  expect(mediaLines(catalogue, 0)).toEqual([
    { label: 'arm_left', kind: 'video' },
    { label: 'arm_right', kind: 'video' },
    { label: 'arm_ear', kind: 'audio' },
  ])
})

test('a label that is none gets the nearest one told', () => {
  const plan = channelPlan({ robotId: ROBOT, connectorId: 'arm_stat' }, { catalogue, isOriginal: false, bare: bare('json-r2u') })
  expect(plan).toMatchObject({ type: 'mismatch', state: { nearest: 'arm_state' } })
})

test('siblings are the other entries of the same connector, whatever it is called; an entry alone has none', () => {
  const [arm, state, other] = [{ ...ARM, connector: 'left' }, { ...STATE, connector: 'left' }, { ...STATE, label: 'right_state', connector: 'right' }]
  expect(siblingsOf({ entries: [arm, other, state] }, arm)).toEqual([state])
  expect(siblingsOf(catalogue, ARM)).toEqual([])
  expect(siblingsOf(null, arm)).toEqual([])
})
