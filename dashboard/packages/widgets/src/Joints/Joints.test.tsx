import { messages, type CatalogueEntry } from '@mosaic/client'
import { cleanup, render, screen } from '@testing-library/react'
import fc from 'fast-check'
import { afterEach, beforeEach, describe, expect, test } from 'vitest'
import { FakeConnection, WithRobot } from '../../test/fakeRobot'
import { FakeStore } from '../../test/fakeStore'
import { isOutside, jointsOf, limitedNames, rangeOf, shareOf, sliderRange } from './joints'
import { Joints } from './Joints'

const ENTRY: CatalogueEntry = { label: 'arm', type: 'x', kind: 'data', dataType: 'json-r2u', direction: 'to-operator', channels: [], delivery: 'latest', schemaId: messages.SCHEMA_IDS.JointState }
const SAFETY = { limits: { 'positions.*': { min: -2, max: 2 }, 'positions.elbow': { min: 0 }, 'linear.x': { max: 1 } } }
const TARGET: CatalogueEntry = { ...ENTRY, label: 'move', dataType: 'json-u2r', direction: 'to-robot', schemaId: messages.SCHEMA_IDS.JointTarget, safety: SAFETY }

describe('joints', () => {
  test('are read by their names, ours and those of ROS; what is not known is null', () => {
    expect(jointsOf({ names: ['a', 'b'], positions: [1, 2], velocities: [], efforts: [3, 4] })).toEqual([
      { name: 'a', position: 1, velocity: null, effort: 3 },
      { name: 'b', position: 2, velocity: null, effort: 4 },
    ])
    expect(jointsOf({ name: ['a'], position: [1], velocity: [0.5] })).toEqual([{ name: 'a', position: 1, velocity: 0.5, effort: null }])
  })

  test.each([null, {}, { names: [] }, { names: ['a', 'a'], positions: [1, 2] }, { names: [1] }])('%j has none', (message) =>
    expect(jointsOf(message)).toBeNull(),
  )

  test('have the limits of their own and those of all', () => {
    expect(rangeOf(SAFETY, 'positions.elbow')).toEqual({ min: 0, max: 2 })
    expect(rangeOf(SAFETY, 'positions.wrist')).toEqual({ min: -2, max: 2 })
    expect(rangeOf(undefined, 'position')).toEqual({ min: null, max: null })
    expect(limitedNames(SAFETY, 'positions')).toEqual(['elbow'])
  })

  test('stand within a slider, wherever they are', () => {
    const bound = fc.option(fc.integer({ min: -9, max: 9 }))
    fc.assert(
      fc.property(bound, bound, fc.option(fc.integer({ min: -9, max: 9 })), (min, max, position) => {
        const range = sliderRange({ min, max }, position)
        expect(range.min).toBeLessThanOrEqual(range.max)
        if (min !== null && max !== null && min <= max) expect(range).toEqual({ min, max })
        const share = shareOf(position, range)
        expect(share === null || (share >= 0 && share <= 1)).toBe(true)
      }),
    )
    expect(isOutside(3, { min: null, max: 2 })).toBe(true)
    expect(isOutside(null, { min: 0, max: 0 })).toBe(false)
  })
})

describe('the table', () => {
  let store: FakeStore
  beforeEach(() => {
    store = new FakeStore()
  })
  afterEach(cleanup)

  function shown(): void {
    const connection = new FakeConnection()
    connection.catalogue.set({ hash: '', entries: [ENTRY, TARGET] })
    render(
      <WithRobot connection={connection}>
        <Joints robotId="r" entry={ENTRY} store={store.asStore} />
      </WithRobot>,
    )
  }

  test('has a row for each joint, with a bar between its limits', () => {
    shown()
    expect(screen.getByText('No joints yet')).toBeTruthy()
    store.say({ names: ['elbow', 'wrist'], positions: [0.5, 3], velocities: [0.1, 0], efforts: [] })
    expect(screen.getAllByRole('row').map((row) => row.textContent)).toEqual(['JointPosition (rad)Within its limitsrad/s', 'elbow0.5000.100', 'wrist3.0000.000'])
    const bar = screen.getByRole('meter', { name: 'elbow within its limits' })
    expect(bar.getAttribute('aria-valuetext')).toBe('0.500 of 0.000 to 2.000')
    expect(screen.getByRole('row', { name: /wrist/ }).getAttribute('data-outside')).toBe('true')
  })

  test('says so where a message has no joints', () => {
    shown()
    store.say({ percent: 3 })
    expect(screen.getByText('Not the state of joints')).toBeTruthy()
  })

  test.each([{ names: [], positions: [] }, { name: [] }])('says of %j that there are none, which is no mistake', (message) => {
    shown()
    store.say(message)
    expect(screen.getByText('No joints')).toBeTruthy()
  })
})
