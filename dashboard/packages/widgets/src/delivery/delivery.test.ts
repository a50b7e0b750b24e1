import { StoreCounters, type DeliveryRow } from '@mosaic/client'
import { describe, expect, test } from 'vitest'
import { failureText, queueText, rateText, sizeText } from './deliveryText'
import { DropWatch } from './DropWatch'

const row = (changes: Partial<DeliveryRow>) => ({ dropped: 0, tooLarge: 0, lost: 0, ...changes }) as DeliveryRow

describe('drops', () => {
  test('of before the page came are old news', () => {
    expect(new DropWatch('reliable').sample(new StoreCounters(), row({ dropped: 100 }))).toBe(false)
  })

  test('are marked for some seconds', () => {
    const watch = new DropWatch('reliable')
    const counters = new StoreCounters()
    watch.sample(counters, row({}))
    const marked = [1, 1, 1, 1, 1, 1, 1].map((lost) => watch.sample(counters, row({ lost })))
    expect(marked).toEqual([true, true, true, true, true, false, false])
  })

  test('for their size are marked like those of full queues', () => {
    const watch = new DropWatch('latest')
    const counters = new StoreCounters()
    watch.sample(counters, row({}))
    expect(watch.sample(counters, row({ tooLarge: 1 }))).toBe(true)
  })

  test('of a few values that may be skipped are nothing to worry about, many are', () => {
    const watch = new DropWatch('latest')
    const counters = new StoreCounters()
    watch.sample(counters, undefined)
    Object.assign(counters, { received: 95, missed: 5 })
    expect(watch.sample(counters, undefined)).toBe(false)
    Object.assign(counters, { received: 190, missed: 60 })
    expect(watch.sample(counters, undefined)).toBe(true)
  })

  test('of a reliable connector are marked from the first', () => {
    const watch = new DropWatch('reliable')
    const counters = new StoreCounters()
    watch.sample(counters, undefined)
    Object.assign(counters, { received: 1000, missed: 1 })
    expect(watch.sample(counters, undefined)).toBe(true)
  })

  test('of a robot that was started anew are counted anew', () => {
    const watch = new DropWatch('bulk')
    const counters = new StoreCounters()
    watch.sample(counters, row({ dropped: 50 }))
    expect(watch.sample(counters, row({ dropped: 0 }))).toBe(false)
    watch.sample(counters, row({ dropped: 0 }))
    expect(watch.sample(counters, row({ dropped: 1 }))).toBe(true)
  })
})

test('a connector that fails is told with its reason and its next try', () => {
  expect(failureText({ failureCode: 'plugin.no_device', triesAgainInS: 7.2 })).toBe(
    "It fails (plugin.no_device): The connector's device isn't available; it is being tried again. Next try in 8 s.",
  )
  expect(failureText({ failureCode: 'plugin.failed' })).not.toContain('Next try')
  expect(failureText({})).toBe('')
})

test('numbers are short and have units', () => {
  expect([0, 999, 1500, 2.5e6].map(sizeText)).toEqual(['0 B', '999 B', '1.5 KB', '2.5 MB'])
  expect(rateText({ rateHz: 9.96, bytesPerS: 1200 })).toBe('10.0/s · 1.2 KB/s')
  expect([queueText(0, 0), queueText(2, 1500)]).toEqual(['–', '2 · 1.5 KB'])
})
