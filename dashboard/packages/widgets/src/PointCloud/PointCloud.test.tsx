import { Value, type CatalogueEntry, type StoreState } from '@mosaic/client'
import { act, cleanup, render, screen } from '@testing-library/react'
import { afterEach, beforeEach, expect, test, vi } from 'vitest'
import { FakeConnection, WithRobot } from '../../test/fakeRobot'
import type { AnyStore } from '../stores/storeKinds'
import type { Camera } from './camera'
import type { Style } from './CloudRenderer'
import { CloudView, type Draws } from './CloudView'
import type { PointCloud as Cloud } from '../clouds/compactCloud'
import { PointCloud } from './PointCloud'

const ENTRY: CatalogueEntry = {
  label: 'lidar',
  type: 'point-cloud',
  kind: 'data',
  dataType: 'byte-r2u',
  direction: 'to-operator',
  channels: [],
  delivery: 'bulk',
}

const SQUARE: Cloud = {
  count: 4,
  positions: Float32Array.from([0, 0, 0, 2, 0, 0, 2, 2, 1, 0, 2, 1]),
  origin: [100, 0, 0],
  intensities: null,
  intensityRange: [0, 0],
  colours: null,
  frameId: '',
  capturedUs: 0,
  resolutionM: 0.01,
}

let frames: FrameRequestCallback[]

beforeEach(() => {
  frames = []
  vi.stubGlobal('requestAnimationFrame', (frame: FrameRequestCallback) => frames.push(frame))
  vi.stubGlobal('cancelAnimationFrame', () => undefined)
})

afterEach(() => {
  cleanup()
  vi.unstubAllGlobals()
})

function viewed(hasGraphics = true, isSlow = false) {
  const canvas = document.createElement('canvas')
  Object.defineProperty(canvas, 'clientWidth', { value: 400 })
  Object.defineProperty(canvas, 'clientHeight', { value: 300 })
  const drawn: { camera: Camera; style: Style }[] = []
  const shown: Cloud[] = []
  const renderer: Draws = {
    show: (cloud) => shown.push(cloud),
    draw: (camera, style) => drawn.push({ camera, style }),
    dispose: () => undefined,
    isSlow,
  }
  const drawable: boolean[] = []
  const view = new CloudView(canvas, (is) => drawable.push(is), () => (hasGraphics ? renderer : null))
  const paint = () => frames.splice(0).forEach((frame) => frame(0))
  return { canvas, drawn, shown, drawable, view, paint }
}

test('the first cloud decides where the camera stands, later ones leave it to the person', () => {
  const { canvas, drawn, view, paint } = viewed()
  view.show({ ...SQUARE, count: 0 })
  view.show(SQUARE)
  paint()
  expect(drawn.at(-1)?.camera.target[0]).toBeCloseTo(101)
  canvas.dispatchEvent(new KeyboardEvent('keydown', { key: 'ArrowLeft' }))
  view.show({ ...SQUARE, origin: [500, 0, 0] })
  paint()
  expect(drawn.at(-1)?.camera.target[0]).toBeCloseTo(101)
  view.fit()
  paint()
  expect(drawn.at(-1)?.camera.target[0]).toBeCloseTo(501)
})

test('many clouds and movements before a frame are painted once', () => {
  const { drawn, view, paint } = viewed()
  for (let index = 0; index < 10; index++) view.show(SQUARE)
  view.setStyle('distance', 3)
  paint()
  expect(drawn.length).toBe(1)
  expect(drawn[0]?.style.mode).toBe('distance')
  expect(drawn[0]?.style.span[0]).toBeGreaterThan(99)
})

test('without a graphics card the page gets its time back between pictures, and the last cloud is shown', () => {
  vi.useFakeTimers({ toFake: ['setTimeout', 'clearTimeout', 'performance'] })
  const { drawn, view, paint } = viewed(true, true)
  for (let index = 0; index < 20; index++) {
    view.show({ ...SQUARE, origin: [index, 0, 0] })
    paint()
    vi.advanceTimersByTime(100)
  }
  vi.advanceTimersByTime(500)
  paint()
  expect(drawn.length).toBeGreaterThanOrEqual(4)
  expect(drawn.length).toBeLessThanOrEqual(6)
  const count = drawn.length
  vi.advanceTimersByTime(5000)
  paint()
  expect(drawn.length).toBe(count)
  view.setStyle('distance', 1)
  paint()
  view.setStyle('distance', 2)
  view.dispose()
  vi.advanceTimersByTime(5000)
  paint()
  expect(drawn.length).toBe(count + 1)
  vi.useRealTimers()
})

test('a drag turns the picture and the arrows do not drive meanwhile', () => {
  const { canvas, drawn, view, paint } = viewed()
  view.show(SQUARE)
  paint()
  const before = drawn.at(-1)?.camera.yawRad ?? 0
  canvas.setPointerCapture = () => undefined
  const pointer = (type: string, clientX: number) => canvas.dispatchEvent(new PointerEvent(type, { pointerId: 1, clientX, clientY: 0 }))
  pointer('pointerdown', 0)
  pointer('pointermove', 60)
  pointer('pointerup', 60)
  pointer('pointermove', 200)
  paint()
  expect(drawn.at(-1)?.camera.yawRad).toBeLessThan(before)
  document.body.append(canvas)
  const heard = vi.fn()
  window.addEventListener('keydown', heard)
  canvas.dispatchEvent(new KeyboardEvent('keydown', { key: 'ArrowUp', bubbles: true }))
  expect(heard).not.toHaveBeenCalled()
  canvas.dispatchEvent(new KeyboardEvent('keydown', { key: 'w', bubbles: true }))
  expect(heard).toHaveBeenCalledTimes(1)
  window.removeEventListener('keydown', heard)
  canvas.remove()
})

test('a lost graphics context is said, and its return shows the last cloud', () => {
  const { canvas, shown, drawable, view } = viewed()
  view.show(SQUARE)
  canvas.dispatchEvent(new Event('webglcontextlost', { cancelable: true }))
  canvas.dispatchEvent(new Event('webglcontextrestored'))
  expect(drawable).toEqual([true, false, true])
  expect(shown).toEqual([SQUARE, SQUARE])
  view.dispose()
})

test('a page without WebGL says what to do', () => {
  const store = { state: new Value<StoreState>({ phase: 'open' }), latest: null, subscribe: () => () => undefined }
  act(() => {
    render(
      <WithRobot connection={new FakeConnection()}>
        <PointCloud robotId="r" entry={ENTRY} store={store as unknown as AnyStore} />
      </WithRobot>,
    )
  })
  expect(screen.getByText("This browser can't draw point clouds now")).toBeTruthy()
  expect(screen.getByRole('img').getAttribute('aria-label')).toContain('lidar')
})
