import { expect, test, vi } from 'vitest'
import { takeAddressCode } from './addressCodes'

function page(hash: string, pathname = '/', search = '') {
  return { location: { hash, pathname, search }, history: { state: null, replaceState: vi.fn() } }
}

test.each([
  ['#code=abc_-1', 'code'],
  ['#pair=abc_-1', 'pair'],
])('a code (%s) is taken out of the address', (hash, kind) => {
  const address = page(hash, '/robots/7', '?x=1')
  expect(takeAddressCode(address)).toEqual({ kind, value: 'abc_-1' })
  expect(address.history.replaceState).toHaveBeenCalledWith(null, '', '/robots/7?x=1')
})

test('what else stands in the fragment stays', () => {
  const address = page('#code=abc&tab=2')
  expect(takeAddressCode(address)?.value).toBe('abc')
  expect(address.history.replaceState).toHaveBeenCalledWith(null, '', '/#tab=2')
})

test.each(['', '#', '#main'])('without a code (%s) the address is left alone', (hash) => {
  const address = page(hash)
  expect(takeAddressCode(address)).toBeNull()
  expect(address.history.replaceState).not.toHaveBeenCalled()
})

test.each(['#code=', '#pair='])('an empty code (%s) is none, and goes too', (hash) => {
  const address = page(hash)
  expect(takeAddressCode(address)).toBeNull()
  expect(address.history.replaceState).toHaveBeenCalled()
})

test('of two only one is used, and both go', () => {
  const address = page('#pair=p&code=c')
  expect(takeAddressCode(address)).toEqual({ kind: 'code', value: 'c' })
  expect(address.history.replaceState).toHaveBeenCalledWith(null, '', '/')
})
