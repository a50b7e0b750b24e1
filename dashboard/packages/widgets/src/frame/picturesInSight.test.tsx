import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest'
import { addPicture, isPictureInSight, pictureRect, shareInSight, type Screen } from './picturesInSight'

const SCREEN = { left: 0, top: 0, right: 600, bottom: 300, full: null }
let taken: (() => void)[] = []

beforeEach(() => document.body.replaceChildren())
afterEach(() => {
  taken.forEach((take) => take())
  taken = []
  vi.restoreAllMocks()
})

function placed(left: number, top: number, width = 300, height = 300): HTMLElement {
  const element = document.createElement('div')
  vi.spyOn(element, 'getBoundingClientRect').mockReturnValue(new DOMRect(left, top, width, height))
  document.body.append(element)
  return element
}

const picture = (...place: [number, number, number?, number?]) => {
  const element = placed(...place)
  taken.push(addPicture('r', element))
  return element
}

/** A screen on which this lies uppermost everywhere. */
const under = (element: Element, part: Partial<Screen> = {}): Screen => ({ ...SCREEN, uppermost: () => element, ...part })

describe('a picture is in sight', () => {
  test('by the share of it that is on the screen', () => {
    const shown = picture(0, 0)
    expect(shareInSight(shown, under(shown))).toBe(1)
    expect(shareInSight(shown, under(shown, { bottom: 100 }))).toBeCloseTo(1 / 3)
    expect(shareInSight(shown, under(shown, { top: 400, bottom: 700 }))).toBe(0)
  })

  test('not while something lies over it', () => {
    const shown = picture(0, 0)
    expect(isPictureInSight('r', under(shown))).toBe(true)
    expect(isPictureInSight('r', under(placed(0, 0)))).toBe(false)
  })

  test('not where two fingers have zoomed in beside it', () => {
    const shown = picture(0, 0)
    expect(isPictureInSight('r', under(shown, { left: 300, right: 600 }))).toBe(false)
  })

  test('lies where it is shown, without the bars beside it', () => {
    const card = picture(0, 0, 600, 300)
    const video = document.createElement('video')
    Object.defineProperties(video, { videoWidth: { value: 640 }, videoHeight: { value: 160 } })
    vi.spyOn(video, 'getBoundingClientRect').mockReturnValue(new DOMRect(0, 0, 600, 300))
    card.append(video)
    expect(pictureRect(card)).toMatchObject({ left: 0, top: 75, width: 600, height: 150 })
  })

  test('not while it has no size', () => {
    const shown = picture(0, 0, 0, 0)
    expect(isPictureInSight('r', under(shown))).toBe(false)
  })

  test('where the page has none: the robot is looked at directly', () => {
    const elsewhere = picture(0, 0)
    expect(isPictureInSight('another', under(placed(0, 0)))).toBe(true)
    expect(isPictureInSight('r', under(elsewhere))).toBe(true)
  })
})

test('the first picture of the page leads, whichever came first', () => {
  const second = picture(0, 400)
  const first = placed(0, 0)
  document.body.prepend(first)
  taken.push(addPicture('r', first))
  expect(isPictureInSight('r', under(first))).toBe(true)
  expect(isPictureInSight('r', under(second))).toBe(false)
})

test('the picture that fills the screen leads', () => {
  picture(0, 0)
  const rear = picture(0, 400)
  const full = document.createElement('div')
  rear.append(full)
  vi.spyOn(full, 'getBoundingClientRect').mockReturnValue(new DOMRect(0, 0, 600, 300))
  expect(isPictureInSight('r', under(full, { full }))).toBe(true)
  expect(isPictureInSight('r', under(full))).toBe(false)
})
