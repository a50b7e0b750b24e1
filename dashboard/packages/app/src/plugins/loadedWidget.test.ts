import type { WidgetModule, WidgetOffer } from '@mosaic/client'
import * as React from 'react'
import { afterEach, expect, test, vi } from 'vitest'
import { LOAD_TIMEOUT_MS, loadedWidget, type ImportModule } from './loadedWidget'

const MODULE: WidgetModule = { name: 'acme-arm', distribution: 'acme-arm', version: '1.2.0', sha256: 'a'.repeat(64), sizeBytes: 10 }
const WANTED = { module: MODULE, exportName: 'ArmPanel' }
const URL = `/widgets/${MODULE.sha256}.js`
const ArmPanel = () => null

function server(offer: WidgetOffer = { isOn: true, modules: [MODULE] }) {
  return { widgets: vi.fn(() => Promise.resolve(offer)) }
}

/** What the import map gives for `react`, and what the server has under any other address. */
function modules(served: () => Promise<Record<string, unknown>> = () => Promise.resolve({ apiVersion: 1, ArmPanel }), react: object = React) {
  return vi.fn<ImportModule>((url) => (url === 'react' ? Promise.resolve({ ...react }) : served()))
}

afterEach(() => {
  vi.useRealTimers()
})

test('the module is imported by its hash, and the server asked once for all cards', async () => {
  const api = server()
  const load = modules()
  expect(await loadedWidget(api, WANTED, 0, load)).toBe(ArmPanel)
  expect(await loadedWidget(api, WANTED, 0, load)).toBe(ArmPanel)
  expect(load).toHaveBeenCalledWith(URL)
  expect(api.widgets).toHaveBeenCalledTimes(1)
})

test('nothing is imported that the server does not have', async () => {
  const load = modules()
  await expect(loadedWidget(server({ isOn: true, modules: [] }), WANTED, 0, load)).rejects.toThrow('does not have this plugin')
  expect(load).not.toHaveBeenCalled()
})

test('a further attempt asks the server anew, and under another address, as browsers remember failures', async () => {
  const api = server({ isOn: true, modules: [] })
  const load = modules()
  await expect(loadedWidget(api, WANTED, 0, load)).rejects.toThrow()
  api.widgets.mockResolvedValue({ isOn: true, modules: [MODULE] })
  expect(await loadedWidget(api, WANTED, 1, load)).toBe(ArmPanel)
  expect(load).toHaveBeenCalledWith(`${URL}?attempt=1`)
})

test('a server that does not answer is asked again by the next card', async () => {
  const api = server()
  api.widgets.mockRejectedValueOnce(new Error('the server answered 404'))
  await expect(loadedWidget(api, WANTED, 0, modules())).rejects.toThrow(/too old for them. the server answered 404/)
  expect(await loadedWidget(api, WANTED, 0, modules())).toBe(ArmPanel)
})

test('code that throws while it is loaded is told with its own words', async () => {
  const load = modules(() => Promise.reject(new Error('boom')))
  await expect(loadedWidget(server(), WANTED, 0, load)).rejects.toThrow('Its code could not be loaded. boom')
})

test.each([
  [new SyntaxError("Unexpected token ')'"), "acme-arm.js is no JavaScript: Unexpected token ')'. `node --check acme-arm.js` shows the line."],
  [Object.assign(new SyntaxError('expected expression'), { lineNumber: 7 }), 'acme-arm.js:7 is no JavaScript: expected expression.'],
  [new SyntaxError("'react' does not provide an export named 'useStat'"), "Its code could not be loaded. 'react' does not provide"],
])('what is no JavaScript is told with its file, and who shows the line: %s', async (error, told) => {
  const load = modules(() => Promise.reject(error))
  await expect(loadedWidget(server(), WANTED, 0, load)).rejects.toThrow(told)
})

test('code that never arrives is given up', async () => {
  vi.useFakeTimers()
  const loading = loadedWidget(server(), WANTED, 0, modules(() => new Promise(() => {})))
  const refused = expect(loading).rejects.toThrow('did not arrive within 20 s')
  await vi.advanceTimersByTimeAsync(LOAD_TIMEOUT_MS)
  await refused
})

test('a page that is older than the server’s loads no second React', async () => {
  const load = modules(undefined, { createElement: () => null })
  await expect(loadedWidget(server(), WANTED, 0, load)).rejects.toThrow('reload it')
  expect(load).not.toHaveBeenCalledWith(URL)
})
