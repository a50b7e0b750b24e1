import { expect, test, vi } from 'vitest'
import type { DataPort } from '@mosaic/client/parts'
import { dataEntry, catalogueOf } from '../src/connectors/catalogue'
import type { DataTeller } from '../src/connectors/Connector'
import { DataOutlet } from '../src/connectors/DataOutlet'
import { TrackOutlet } from '../src/connectors/TrackOutlet'
import { FakeCamera, settled } from './fakes'

function watcher() {
  return { sender: { replaceTrack: vi.fn(() => Promise.resolve()) }, unavailable: vi.fn() }
}

function outlet(camera: FakeCamera) {
  const changed = vi.fn()
  return { films: new TrackOutlet(camera, changed), changed }
}

test('a camera is on from the first who watches to the last', async () => {
  const camera = new FakeCamera()
  const { films, changed } = outlet(camera)
  const [ada, bob] = [watcher(), watcher()]
  expect(camera.isAsked).toBe(false)
  films.watch(ada)
  films.watch(bob)
  const track = await camera.opens()
  expect(ada.sender.replaceTrack).toHaveBeenCalledWith(track)
  expect(bob.sender.replaceTrack).toHaveBeenCalledWith(track)
  expect(camera.tracks.length).toBe(1)
  films.unwatch(ada)
  expect(track.isStopped).toBe(false)
  films.unwatch(bob)
  expect(track.isStopped).toBe(true)
  expect(changed.mock.lastCall).toEqual(['camera', null, ''])
})

test('a camera that opens when nobody wants it any more is closed at once', async () => {
  const camera = new FakeCamera()
  const { films, changed } = outlet(camera)
  const ada = watcher()
  films.watch(ada)
  films.unwatch(ada)
  const track = await camera.opens()
  expect(track.isStopped).toBe(true)
  expect(changed).not.toHaveBeenCalled()
})

test('who comes back while it opens gets the second picture, and the first camera is closed', async () => {
  const camera = new FakeCamera()
  const { films } = outlet(camera)
  const ada = watcher()
  films.watch(ada)
  films.unwatch(ada)
  films.watch(ada)
  const first = await camera.opens()
  const second = await camera.opens()
  expect(first.isStopped).toBe(true)
  expect(second.isStopped).toBe(false)
  expect(ada.sender.replaceTrack.mock.lastCall).toEqual([second])
})

test('why there is no picture is told, and it is tried again when the page is looked at', async () => {
  const camera = new FakeCamera()
  const { films, changed } = outlet(camera)
  const ada = watcher()
  films.watch(ada)
  await camera.fails('held by another program')
  expect(ada.unavailable).toHaveBeenCalledWith('held by another program')
  expect(changed).toHaveBeenCalledWith('camera', null, 'held by another program')
  films.reopen()
  const track = await camera.opens()
  track.onended?.()
  expect(ada.unavailable).toHaveBeenCalledTimes(2)
  films.reopen()
  expect((await camera.opens()).isStopped).toBe(false)
  films.reopen()
  expect(camera.isAsked).toBe(false)
})

test('a camera that the system holds back is told, and is opened anew if it still gives nothing when the page is looked at', async () => {
  const camera = new FakeCamera()
  const { films, changed } = outlet(camera)
  const ada = watcher()
  films.watch(ada)
  const first = await camera.opens()
  first.muted = true
  first.onmute?.()
  expect(ada.unavailable).toHaveBeenCalledWith(expect.stringContaining('locked screen'))
  // Its light may be on: the page doesn't say that it is off.
  expect(changed).toHaveBeenLastCalledWith('camera', first, expect.stringContaining('locked screen'))
  films.reopen()
  const second = await camera.opens()
  expect(first.isStopped).toBe(true)
  expect(ada.sender.replaceTrack.mock.lastCall).toEqual([second])
  expect(changed).toHaveBeenLastCalledWith('camera', second, '')
})

test('a camera that goes on by itself is left alone', async () => {
  const camera = new FakeCamera()
  const { films, changed } = outlet(camera)
  films.watch(watcher())
  const track = await camera.opens()
  track.muted = true
  track.onmute?.()
  track.muted = false
  track.onunmute?.()
  expect(changed).toHaveBeenLastCalledWith('camera', track, '')
  films.reopen()
  expect(camera.isAsked).toBe(false)
  expect(track.isStopped).toBe(false)
})

test('a camera that ended without a word, as in a page that stood still, is opened anew', async () => {
  const camera = new FakeCamera()
  const { films } = outlet(camera)
  const ada = watcher()
  films.watch(ada)
  const first = await camera.opens()
  first.readyState = 'ended'
  films.reopen()
  const second = await camera.opens()
  expect(ada.sender.replaceTrack.mock.lastCall).toEqual([second])
})

test('another camera takes over for whoever watches', async () => {
  const [back, front] = [new FakeCamera(), new FakeCamera()]
  const { films } = outlet(back)
  const ada = watcher()
  films.watch(ada)
  const before = await back.opens()
  films.reopen(front)
  const after = await front.opens()
  expect(before.isStopped).toBe(true)
  expect(ada.sender.replaceTrack.mock.lastCall).toEqual([after])
})

function sensor() {
  let teller: DataTeller | null = null
  const end = vi.fn()
  const connector = {
    entry: dataEntry('battery', 'BatteryState', 'latest'),
    start: (given: DataTeller) => {
      teller = given
      return end
    },
  }
  return { connector, end, tell: (value: object) => teller?.tell(value), isOn: () => teller !== null }
}

function port() {
  const fake = { send: vi.fn(), repeat: vi.fn() }
  return { ...fake, asPort: fake as unknown as DataPort }
}

test('what nobody listens to is not measured, and who comes late gets the last value with its time', async () => {
  const { connector, end, tell, isOn } = sensor()
  let now = 5
  const outlet = new DataOutlet(connector, () => now, vi.fn())
  const [ada, bob] = [port(), port()]
  expect(isOn()).toBe(false)
  outlet.join(ada.asPort)
  tell({ percent: 7 })
  now = 9
  outlet.join(bob.asPort)
  const bytes = new TextEncoder().encode('{"percent":7}')
  expect(ada.send).toHaveBeenCalledWith(bytes)
  expect(bob.repeat).toHaveBeenCalledWith(bytes, 5000)
  outlet.leave(ada.asPort)
  expect(end).not.toHaveBeenCalled()
  outlet.leave(bob.asPort)
  outlet.leave(bob.asPort)
  expect(end).toHaveBeenCalledOnce()
  await settled()
})

test('two catalogues have the same hash if they say the same', () => {
  const one = dataEntry('log', 'Log', 'reliable')
  expect(catalogueOf([one])).toEqual(catalogueOf([{ ...one }]))
  expect(catalogueOf([one]).hash).toMatch(/^[0-9a-f]{16}$/)
  expect(catalogueOf([]).hash).not.toBe(catalogueOf([one]).hash)
})
