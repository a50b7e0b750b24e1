import type { WidgetModule } from '@mosaic/client'
import { expect, test } from 'vitest'
import { servedModule } from './servedModule'

const WANTED: WidgetModule = { name: 'acme-arm', distribution: 'acme-arm', version: '1.2.0', sha256: 'a'.repeat(64), sizeBytes: 10 }

test('the very bytes that the robot announces are loaded, by their hash', () => {
  const offer = { isOn: true, modules: [{ ...WANTED, sha256: 'b'.repeat(64) }, WANTED] }
  expect(servedModule(WANTED, offer)).toEqual({ url: `/widgets/${'a'.repeat(64)}.js` })
})

test('where they are switched off it says so', () => {
  expect(servedModule(WANTED, { isOn: false, modules: [] })).toEqual({ why: expect.stringContaining('switched off') as string })
})

test('a module that the server does not have is no fault of the robot', () => {
  const served = servedModule(WANTED, { isOn: true, modules: [{ ...WANTED, name: 'acme-leg', sha256: 'b'.repeat(64) }] })
  expect(served).toEqual({ why: expect.stringContaining('The server does not have this plugin') as string })
})

test('another version on the server is named beside the robot’s', () => {
  const served = servedModule(WANTED, { isOn: true, modules: [{ ...WANTED, version: '1.1.0', sha256: 'b'.repeat(64) }] })
  expect(served).toEqual({ why: expect.stringContaining('The robot has acme-arm 1.2.0, the server has acme-arm 1.1.0.') as string })
})

test('other bytes under the same version are told apart too', () => {
  const served = servedModule(WANTED, { isOn: true, modules: [{ ...WANTED, sha256: 'b'.repeat(64) }] })
  expect(served).toEqual({ why: expect.stringContaining('acme-arm 1.2.0 of the robot and of the server are not the same') as string })
})
