import fc from 'fast-check'
import { describe, expect, test, vi } from 'vitest'
import { MarkLog, marksOf, markText, placementOf, WORTH_MS, type Marks } from './marks'
import { paintMarks } from './paintMarks'

const BOX = { x: 10, y: 20, width: 30, height: 40, label: 'cup', score: 0.914, color: '#ff0000' }

test('marks are read with tolerance', () => {
  const marks = marksOf({ camera: 'front', width: 640, height: 480, captured_at_us: 5e6, boxes: [BOX, { x: 1 }], lines: [{ points: [{ x: 1, y: 2 }], closed: true }, {}], texts: [{ x: 0, y: 0, text: 'hi', color: 'red' }] })
  expect(marks).toMatchObject({ camera: 'front', size: { width: 640, height: 480 }, capturedUs: 5e6 })
  expect(marks?.boxes).toEqual([{ x: 10, y: 20, width: 30, height: 40, text: 'cup 91 %', colour: '#ff0000' }])
  expect(marks?.lines).toEqual([{ points: [{ x: 1, y: 2 }], isClosed: true, colour: null }])
  expect(marks?.texts).toEqual([{ x: 0, y: 0, text: 'hi', colour: null }])
  expect(marks && markText(marks)).toBe('1 box, 1 line, 1 text')
})

test.each([null, 5, {}, { boxes: 3 }])('%j marks nothing', (message) => expect(marksOf(message)).toBeNull())

const empty: Marks = { camera: null, size: null, capturedUs: null, boxes: [], lines: [], texts: [] }

describe('the marks of a picture', () => {
  test('are those that were found in it, or in the last one before', () => {
    const log = new MarkLog()
    const [first, second] = [{ ...empty }, { ...empty }]
    log.add(second, 200)
    log.add(first, 100)
    expect(log.at(90)).toMatchObject({ lateMs: 0 })
    expect(log.at(150)?.marks).toBe(first)
    expect(log.at(150)?.lateMs).toBe(50)
    expect(log.at(200)?.marks).toBe(second)
    expect(log.at(80)).toBeNull()
    expect(log.at(201 + WORTH_MS)).toBeNull()
  })

  test('are never those of a later picture, nor of one long ago, in whatever order they come', () => {
    fc.assert(
      fc.property(fc.array(fc.integer({ min: 0, max: 5000 }), { maxLength: 40 }), fc.integer({ min: 0, max: 6000 }), (times, shownAt) => {
        const log = new MarkLog()
        for (const time of times) log.add({ ...empty, capturedUs: time }, time)
        const found = log.at(shownAt)?.marks.capturedUs
        const fitting = times.filter((time) => time <= shownAt + 10 && shownAt - time <= WORTH_MS)
        expect(found ?? null).toBe(fitting.length === 0 ? null : Math.max(...fitting))
      }),
    )
  })
})

test('marks lie where the picture lies that is shown whole', () => {
  expect(placementOf({ width: 640, height: 480 }, { width: 640, height: 640 })).toEqual({ scale: 1, left: 0, top: 80, width: 640, height: 480 })
  const context = { strokeRect: vi.fn(), fillRect: vi.fn(), fillText: vi.fn(), measureText: () => ({ width: 40 }), beginPath: vi.fn(), moveTo: vi.fn(), lineTo: vi.fn(), closePath: vi.fn(), stroke: vi.fn(), rect: vi.fn(), clip: vi.fn(), save: vi.fn(), restore: vi.fn() }
  const marks = marksOf({ boxes: [BOX, { ...BOX, x: -9, y: -3, label: 'cut' }], lines: [{ points: [{ x: 0, y: 0 }, { x: 1, y: 1 }], closed: true }], texts: [] })
  if (marks !== null) paintMarks({ context: context as unknown as CanvasRenderingContext2D }, marks, { scale: 2, left: 5, top: 7, width: 640, height: 480 })
  expect(context.rect).toHaveBeenCalledWith(5, 7, 640, 480)
  expect(context.clip).toHaveBeenCalledBefore(context.strokeRect)
  expect(context.fillText).toHaveBeenCalledWith('cut 91 %', 8, 21)
  expect(context.strokeRect).toHaveBeenCalledWith(25, 47, 60, 80)
  expect(context.fillText).toHaveBeenCalledWith('cup 91 %', 26, 43)
  expect(context.lineTo).toHaveBeenCalledWith(7, 9)
})
