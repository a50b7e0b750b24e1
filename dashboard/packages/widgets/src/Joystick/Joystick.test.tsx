import { messages, type CatalogueEntry } from '@mosaic/client'
import { cleanup, render, screen } from '@testing-library/react'
import fc from 'fast-check'
import { afterEach, describe, expect, test } from 'vitest'
import { FakeStore } from '../../test/fakeStore'
import { barOf, stickOf } from './joystick'
import { Joystick } from './Joystick'

const ENTRY: CatalogueEntry = { label: 'stick', type: 'joystick', kind: 'data', dataType: 'json-r2u', direction: 'to-operator', channels: [], delivery: 'latest', schemaId: messages.SCHEMA_IDS.Joy }

describe('a stick', () => {
  test('has names, or numbers where there are none', () => {
    expect(stickOf({ axes: [0.5, -3], buttons: [0, 1], axis_names: ['x', ''], button_names: ['trigger', 'thumb'] })).toEqual({
      axes: [{ name: 'x', value: 0.5 }, { name: '1', value: -1 }],
      buttons: [{ name: 'trigger', isPressed: false }, { name: 'thumb', isPressed: true }],
    })
    expect(stickOf({ axes: [], buttons: [1] })).toEqual({ axes: [], buttons: [{ name: '0', isPressed: true }] })
  })

  test.each([null, {}, { axes: [1] }, { axes: ['1'], buttons: [] }, { axes: [null], buttons: [] }])('%j is none', (message) =>
    expect(stickOf(message)).toBeNull(),
  )

  test('draws a bar that stays within its track', () => {
    fc.assert(
      fc.property(fc.double({ min: -1, max: 1, noNaN: true }), (value) => {
        const { start, length } = barOf(value)
        expect(start).toBeGreaterThanOrEqual(0)
        expect(start + length).toBeLessThanOrEqual(100)
        expect(value < 0 ? start + length : start).toBeCloseTo(50)
      }),
    )
  })
})

describe('the widget', () => {
  afterEach(cleanup)

  test('has a meter for each axis and tells which buttons are pressed', () => {
    const store = new FakeStore()
    render(<Joystick robotId="r" entry={ENTRY} store={store.asStore} />)
    expect(screen.getByText('No stick yet')).toBeTruthy()
    store.say({ axes: [0.25], buttons: [0, 1], axis_names: ['x'], button_names: ['trigger', 'thumb'] })
    expect(screen.getByRole('meter', { name: 'x' }).getAttribute('aria-valuenow')).toBe('0.25')
    expect(screen.getAllByRole('listitem').map((item) => item.getAttribute('aria-label'))).toEqual(['trigger', 'thumb, pressed'])
  })

  test('says so where a message tells of no stick', () => {
    const store = new FakeStore()
    render(<Joystick robotId="r" entry={ENTRY} store={store.asStore} />)
    store.say({ percent: 3 })
    expect(screen.getByText('Not the state of a stick')).toBeTruthy()
  })
})
