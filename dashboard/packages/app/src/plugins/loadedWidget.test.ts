import type { WidgetModule, WidgetOffer } from '@mosaic/client'
import { afterEach, expect, test, vi } from 'vitest'
import { LOAD_TIMEOUT_MS, loadedWidget, type ImportModule } from './loadedWidget'

const MODULE: WidgetModule = { name: 'acme-arm', distribution: 'acme-arm', version: '1.2.0', sha256: 'a'.repeat(64), sizeBytes: 10 }
const WANTED = { module: MODULE, exportName: 'ArmPanel' }
const URL = `/widgets/${MODULE.sha256}.js`
const ArmPanel = () => null

function server(offer: WidgetOffer = { isOn: true, modules: [MODULE] }) {
  return { widgets: vi.fn(() => Promise.resolve(offer)) }
}

function module(exports: Record<string, unknown> = { apiVersion: 1, ArmPanel }) {
  return vi.fn<ImportModule>(() => Promise.resolve(exports))
}

afterEach(() => {
  vi.useRealTimers()
})

test('the module is imported by its hash, and the server asked once for all cards', async () => {
  const api = server()
  const load = module()
  expect(await loadedWidget(api, WANTED, 0, load)).toBe(ArmPanel)
  expect(await loadedWidget(api, WANTED, 0, load)).toBe(ArmPanel)
  expect(load).toHaveBeenCalledWith(URL)
  expect(api.widgets).toHaveBeenCalledTimes(1)
})

test('nothing is imported that the server does not have', async () => {
  const load = module()
  await expect(loadedWidget(server({ isOn: true, modules: [] }), WANTED, 0, load)).rejects.toThrow('does not have this plugin')
  expect(load).not.toHaveBeenCalled()
})

test('a further attempt asks the server anew, and under another address, as browsers remember failures', async () => {
  const api = server({ isOn: true, modules: [] })
  const load = module()
  await expect(loadedWidget(api, WANTED, 0, load)).rejects.toThrow()
  api.widgets.mockResolvedValue({ isOn: true, modules: [MODULE] })
  expect(await loadedWidget(api, WANTED, 1, load)).toBe(ArmPanel)
  expect(load).toHaveBeenCalledWith(`${URL}?attempt=1`)
})

test('a server that does not answer is asked again by the next card', async () => {
  const api = server()
  api.widgets.mockRejectedValueOnce(new Error('the server answered 404'))
  await expect(loadedWidget(api, WANTED, 0, module())).rejects.toThrow(/too old for them. the server answered 404/)
  expect(await loadedWidget(api, WANTED, 0, module())).toBe(ArmPanel)
})

test('code that throws while it is loaded is told with its own words', async () => {
  const load = vi.fn<ImportModule>(() => Promise.reject(new Error('boom')))
  await expect(loadedWidget(server(), WANTED, 0, load)).rejects.toThrow('Its code could not be loaded. boom')
})

test('code that never arrives is given up', async () => {
  vi.useFakeTimers()
  const loading = loadedWidget(server(), WANTED, 0, () => new Promise(() => {}))
  const refused = expect(loading).rejects.toThrow('did not arrive within 20 s')
  await vi.advanceTimersByTimeAsync(LOAD_TIMEOUT_MS)
  await refused
})
