/** Keeps the living picture of a cloud on a canvas: camera, colours and size, painted at most once per frame, past React. */
import { coloursOf } from '../paint/CanvasPainter'
import { fitted, START, type Camera } from './camera'
import { CameraControls } from './CameraControls'
import { extentOf, followed, type Extent, type Extremes } from './cloudExtent'
import { CloudRenderer, type ColourMode } from './CloudRenderer'
import type { PointCloud } from '../clouds/compactCloud'
import { rgbOf } from './rgbOf'

/** What of a renderer the view needs. `isSlow`: without a graphics card every picture takes time from the whole page. */
export type Draws = Pick<CloudRenderer, 'show' | 'draw' | 'dispose'> & { isSlow?: boolean }

const OPTIONS: WebGLContextAttributes = { antialias: false, powerPreference: 'low-power' }
const SLOW_PERIOD_MS = 500
const SLOW_PIXELS = 0.5

/** Null where the browser has no WebGL 2, or none to give. */
export function webglRenderer(canvas: HTMLCanvasElement): Draws | null {
  try {
    const quick = canvas.getContext('webgl2', { ...OPTIONS, failIfMajorPerformanceCaveat: true })
    const gl = quick ?? canvas.getContext('webgl2', OPTIONS)
    return gl === null ? null : Object.assign(new CloudRenderer(gl), { isSlow: quick === null })
  } catch {
    return null
  }
}

export class CloudView {
  private camera: Camera = START
  private cloud: PointCloud | null = null
  private extent: Extent | null = null
  private height: Extremes | null = null
  private distance: Extremes | null = null
  private mode: ColourMode = 'height'
  private pointSize = 2
  private frame = 0
  private pause: ReturnType<typeof setTimeout> | null = null
  private paintedAtMs = -Infinity
  private grid: readonly [number, number, number] | null = null
  private renderer: Draws | null
  private readonly controls: CameraControls
  private readonly resized: ResizeObserver
  private readonly recoloured: MutationObserver
  private readonly ended = new AbortController()

  /** `onDrawable`: whether anything can be drawn, now and after the graphics context was lost or came back. */
  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly onDrawable: (isDrawable: boolean) => void,
    private readonly makeRenderer: (canvas: HTMLCanvasElement) => Draws | null = webglRenderer,
  ) {
    this.renderer = makeRenderer(canvas)
    this.controls = new CameraControls(canvas, (move) => this.move(move(this.camera)), () => this.fit())
    this.resized = new ResizeObserver(() => this.request())
    this.resized.observe(canvas)
    this.recoloured = new MutationObserver(() => {
      this.grid = null
      this.request()
    })
    this.recoloured.observe(document.documentElement, { attributeFilter: ['data-mantine-color-scheme'] })
    const { signal } = this.ended
    canvas.addEventListener('webglcontextlost', (event) => this.lost(event), { signal })
    canvas.addEventListener('webglcontextrestored', () => this.restored(), { signal })
    onDrawable(this.renderer !== null)
    this.request()
  }

  get isDrawable(): boolean {
    return this.renderer !== null
  }

  /** The first cloud with points also decides where the camera stands. */
  show(cloud: PointCloud): void {
    const isFirst = this.extent === null && cloud.count > 0
    this.cloud = cloud
    if (cloud.count > 0) {
      this.extent = extentOf(cloud)
      this.height = followed(this.height, this.extent.height)
      this.distance = followed(this.distance, this.extent.distance)
    }
    this.renderer?.show(cloud)
    if (isFirst) this.fit()
    this.request()
  }

  setStyle(mode: ColourMode, pointSize: number): void {
    this.mode = mode
    this.pointSize = pointSize
    this.request()
  }

  /** Look at all of the newest cloud, from where the camera looks now. */
  fit(): void {
    if (this.extent === null) return
    const aspect = this.canvas.clientWidth / Math.max(1, this.canvas.clientHeight)
    this.move(fitted(this.camera, this.extent.center, this.extent.radiusM, aspect || 1))
  }

  dispose(): void {
    cancelAnimationFrame(this.frame)
    if (this.pause !== null) clearTimeout(this.pause)
    this.ended.abort()
    this.controls.dispose()
    this.resized.disconnect()
    this.recoloured.disconnect()
    this.renderer?.dispose()
  }

  private move(camera: Camera): void {
    this.camera = camera
    this.request()
  }

  private request(): void {
    if (this.frame !== 0 || this.pause !== null) return
    const waitMs = this.renderer?.isSlow === true ? this.paintedAtMs + SLOW_PERIOD_MS - performance.now() : 0
    if (waitMs <= 0) {
      this.frame = requestAnimationFrame(() => this.paint())
      return
    }
    this.pause = setTimeout(() => {
      this.pause = null
      this.request()
    }, waitMs)
  }

  private paint(): void {
    this.frame = 0
    this.paintedAtMs = performance.now()
    const { canvas, renderer } = this
    const { clientWidth, clientHeight } = canvas
    if (renderer === null || clientWidth === 0 || clientHeight === 0) return
    const ratio = renderer.isSlow === true ? SLOW_PIXELS : window.devicePixelRatio || 1
    const [width, height] = [Math.round(clientWidth * ratio), Math.round(clientHeight * ratio)]
    if (canvas.width !== width) canvas.width = width
    if (canvas.height !== height) canvas.height = height
    this.grid ??= rgbOf(coloursOf(canvas).lineStrong)
    renderer.draw(this.camera, {
      mode: this.mode,
      span: this.span(),
      pointSize: this.pointSize * ratio,
      grid: this.grid,
    })
  }

  private span(): Extremes {
    if (this.mode === 'height') return this.height ?? [0, 1]
    if (this.mode === 'distance') return this.distance ?? [0, 1]
    return [0, 1]
  }

  private lost(event: Event): void {
    event.preventDefault() // or it never comes back
    this.renderer = null
    this.onDrawable(false)
  }

  private restored(): void {
    this.renderer = this.makeRenderer(this.canvas)
    if (this.cloud !== null) this.renderer?.show(this.cloud)
    this.onDrawable(this.renderer !== null)
    this.request()
  }
}
