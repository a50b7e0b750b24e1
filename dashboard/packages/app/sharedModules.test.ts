import { readFileSync } from 'node:fs'
import { expect, test } from 'vitest'
import { checkImportMap, importMap, reexported, SHARED, sharedPath } from './sharedModules'

test('each shared library has an address of its own, the same in every build', () => {
  const paths = SHARED.map(sharedPath)
  expect(new Set(paths).size).toBe(SHARED.length)
  expect(sharedPath('react/jsx-runtime')).toBe('shared/react-jsx-runtime.js')
  expect(sharedPath('@mosaic/client')).toBe('shared/mosaic-client.js')
})

test('the page maps the libraries to these addresses, and nothing else', () => {
  const html = readFileSync(new URL('index.html', import.meta.url), 'utf8')
  expect(() => checkImportMap(html)).not.toThrow()
  expect(() => checkImportMap(html.replace('/shared/react.js', '/elsewhere.js'))).toThrow(JSON.stringify(importMap()))
  expect(() => checkImportMap('<html></html>')).toThrow('import map')
})

test('what is CommonJS is exported name by name, what is ours as a whole', () => {
  const names = () => ['useState', 'default', 'no-name', '__INTERNALS']
  expect(reexported('react', names)).toBe('export { useState, __INTERNALS } from "react"\nimport whole from "react"\nexport default whole\n')
  expect(reexported('@mosaic/client', names)).toBe('export * from "@mosaic/client"\n')
})
