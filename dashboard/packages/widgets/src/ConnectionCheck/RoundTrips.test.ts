import { expect, test } from 'vitest'
import { RoundTrips } from './RoundTrips'

test('least, median and most of the last two minutes', () => {
  const trips = new RoundTrips()
  expect(trips.summary()).toBeNull()
  for (const value of [5, 1, 9]) trips.add(value)
  expect(trips.summary()).toEqual({ leastMs: 1, medianMs: 5, mostMs: 9 })
  for (let index = 0; index < 120; index++) trips.add(7)
  expect(trips.summary()).toEqual({ leastMs: 7, medianMs: 7, mostMs: 7 })
})
