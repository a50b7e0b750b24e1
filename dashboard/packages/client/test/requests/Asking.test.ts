import { describe, expect, test } from 'vitest'
import { Asking, MAX_ASKED } from '../../src/requests/Asking'
import { replyOf } from '../../src/requests/requestWords'

const bytes = (value: unknown): ArrayBuffer => new TextEncoder().encode(JSON.stringify(value)).buffer

describe('the requests of a page', () => {
  test('end with an answer or a refusal, and not with progress', () => {
    const asking = new Asking('p')
    const [one, other] = [asking.asked(10), asking.asked(10)]
    expect(asking.heard({ id: one, kind: 'progress', progress: 1 })).not.toBeNull()
    expect(asking.heard({ id: one, kind: 'answer', answer: 2 })).not.toBeNull()
    expect(asking.heard({ id: one, kind: 'answer', answer: 3 })).toBeNull()
    expect(asking.heard({ id: other, kind: 'refused', code: 'x', message: '' })).not.toBeNull()
    expect(asking.size).toBe(0)
    expect(asking.deadlineMs).toBeNull()
  })

  test("never end with another's answer", () => {
    const asking = new Asking('p')
    asking.asked(10)
    expect(asking.heard({ id: 'q-1', kind: 'answer', answer: 1 })).toBeNull()
    expect(asking.size).toBe(1)
  })

  test('end without one in time, or when the way is lost', () => {
    const asking = new Asking('p')
    const [early, late] = [asking.asked(1), asking.asked(2)]
    expect(asking.timePassed(1)).toEqual([{ id: early, code: 'request.timeout' }])
    expect(asking.deadlineMs).toBe(2)
    expect(asking.lost('request.lost')).toEqual([{ id: late, code: 'request.lost' }])
    expect(asking.forgotten(late)).toBe(false)
  })

  test('are no more than a robot takes', () => {
    const asking = new Asking('p')
    const ids = Array.from({ length: MAX_ASKED }, () => asking.asked(1))
    expect(asking.hasRoom).toBe(false)
    expect(new Set(ids).size).toBe(MAX_ASKED)
  })

  test('each end exactly once, whatever happens', () => {
    for (let seed = 1; seed <= 50; seed += 1) {
      let state = seed
      const random = (most: number): number => (state = (state * 48271) % 2147483647) % most
      const asking = new Asking('p')
      const [asked, ended]: [string[], string[]] = [[], []]
      for (let step = 0; step < 60; step += 1) {
        const id = `p-${random(20)}`
        const what = random(6)
        if (what <= 1) asked.push(asking.asked(step + random(10)))
        else if (what === 2 && asking.heard({ id, kind: 'answer', answer: 1 }) !== null) ended.push(id)
        else if (what === 3 && asking.forgotten(id)) ended.push(id)
        else if (what === 4) ended.push(...asking.timePassed(step).map((one) => one.id))
        else if (random(9) === 0) ended.push(...asking.lost('request.lost').map((one) => one.id))
      }
      ended.push(...asking.lost('request.lost').map((one) => one.id))
      expect(ended.toSorted()).toEqual(asked.toSorted())
    }
  })
})

test('a reply is read for what it is, and nothing else is one', () => {
  expect(replyOf(bytes({ id: '1', answer: null }))).toEqual({ id: '1', kind: 'answer', answer: null })
  expect(replyOf(bytes({ id: '1', progress: 3 }))).toEqual({ id: '1', kind: 'progress', progress: 3 })
  expect(replyOf(bytes({ id: '1', refused: { code: 'x', message: 'y' } }))).toEqual({ id: '1', kind: 'refused', code: 'x', message: 'y' })
  for (const other of [{ answer: 1 }, { id: 1, answer: 1 }, { id: '1' }, { id: '1', refused: 2 }, [], 5, null]) expect(replyOf(bytes(other))).toBeNull()
  expect(replyOf(new TextEncoder().encode('{').buffer)).toBeNull()
})
