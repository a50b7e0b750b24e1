import fc from 'fast-check'
import { expect, test } from 'vitest'
import { deviceName } from './deviceName'
import { isWholePin, PIN_DIGITS, shownPin } from './pin'

test.each([
  ['', ''],
  ['1234', '1234'],
  ['12345', '1234 5'],
  ['1234-5678', '1234 5678'],
  ['PIN 1234 56789', '1234 5678'],
])('%j is shown as %j', (typed, shown) => expect(shownPin(typed)).toBe(shown))

test('whatever is typed, showing it twice changes nothing, and whole is eight digits', () => {
  fc.assert(
    fc.property(fc.string(), (typed) => {
      const shown = shownPin(typed)
      expect(shownPin(shown)).toBe(shown)
      expect(isWholePin(shown)).toBe(typed.replace(/\D/g, '').length >= PIN_DIGITS)
    }),
  )
})

test.each([
  ['Mozilla/5.0 (iPhone; CPU iPhone OS 18_0 like Mac OS X) Safari/604.1', 'iPhone'],
  ['Mozilla/5.0 (Linux; Android 15; Pixel 9) Chrome/140 Mobile Safari/537.36', 'Android phone'],
  ['Mozilla/5.0 (Linux; Android 15; SM-X700) Chrome/140 Safari/537.36', 'Android tablet'],
  ['Mozilla/5.0 (Macintosh; Intel Mac OS X 10_15_7) Safari/605', 'Mac'],
  ['Mozilla/5.0 (X11; Linux x86_64) Firefox/140', 'Linux computer'],
  ['something else', 'Browser'],
])('%s is an %s', (userAgent, name) => expect(deviceName(userAgent)).toBe(name))
