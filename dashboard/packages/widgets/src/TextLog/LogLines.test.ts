import { expect, test } from 'vitest'
import { LogLines, matching } from './LogLines'

test('the last five hundred lines are kept, each with its number', () => {
  const log = new LogLines()
  for (let index = 1; index <= 700; index++) log.add(`line ${index}`)
  expect(log.get()).toHaveLength(500)
  expect(log.get()[0]).toEqual({ number: 201, text: 'line 201' })
  log.clear()
  expect(log.get()).toEqual([])
})

test('one endless message does not fill the page', () => {
  const log = new LogLines()
  log.add('x'.repeat(10_000))
  expect(log.get()[0]?.text.length).toBeLessThan(4100)
})

test('the filter knows no case', () => {
  const lines = [
    { number: 1, text: 'Motor hot' },
    { number: 2, text: 'ok' },
  ]
  expect(matching(lines, ' motor ')).toEqual(lines.slice(0, 1))
  expect(matching(lines, '')).toBe(lines)
})
