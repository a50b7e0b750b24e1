import { expect, test } from 'vitest'
import { percentOf, toneOf } from './charge'

test.each([
  [{ percent: 42 }, 42],
  [{ percentage: 142 }, 100],
  [{ battery_percent: -3 }, 0],
  [{ percent: 'full' }, null],
  [null, null],
])('the charge of %j is %s', (message, percent) => {
  expect(percentOf(message)).toBe(percent)
})

test('a low battery is said in colour', () => {
  expect([10, 20, 80].map(toneOf)).toEqual(['bad', 'warn', 'ok'])
})
