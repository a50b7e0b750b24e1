import { expect, test, vi } from 'vitest'
import { takeOneTimeCode } from './oneTimeCode'

function page(hash: string, pathname = '/', search = '') {
  return { location: { hash, pathname, search }, history: { state: null, replaceState: vi.fn() } }
}

test('a code is taken out of the address', () => {
  const address = page('#code=abc_-1', '/robots/7', '?x=1')
  expect(takeOneTimeCode(address)).toBe('abc_-1')
  expect(address.history.replaceState).toHaveBeenCalledWith(null, '', '/robots/7?x=1')
})

test('what else stands in the fragment stays', () => {
  const address = page('#code=abc&tab=2')
  expect(takeOneTimeCode(address)).toBe('abc')
  expect(address.history.replaceState).toHaveBeenCalledWith(null, '', '/#tab=2')
})

test.each(['', '#', '#main'])('without a code (%s) the address is left alone', (hash) => {
  const address = page(hash)
  expect(takeOneTimeCode(address)).toBeNull()
  expect(address.history.replaceState).not.toHaveBeenCalled()
})

test('an empty code is none, and goes too', () => {
  const address = page('#code=')
  expect(takeOneTimeCode(address)).toBeNull()
  expect(address.history.replaceState).toHaveBeenCalled()
})
