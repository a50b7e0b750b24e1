/** Paints a canvas at most once per frame, at the screen's resolution, in the colours of the page. */

export interface Colours {
  line: string
  lineStrong: string
  panel: string
  text: string
  muted: string
  accent: string
  ok: string
  warn: string
  bad: string
}

export interface Surface {
  context: CanvasRenderingContext2D
  width: number
  height: number
  colours: Colours
}

export type Paint = (surface: Surface) => void

export class CanvasPainter {
  private frame = 0
  private colours: Colours | null = null
  private readonly resized: ResizeObserver
  private readonly recoloured: MutationObserver

  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly paint: Paint,
  ) {
    this.resized = new ResizeObserver(() => this.request())
    this.resized.observe(canvas)
    this.recoloured = new MutationObserver(() => {
      this.colours = null
      this.request()
    })
    this.recoloured.observe(document.documentElement, { attributeFilter: ['data-mantine-color-scheme'] })
    this.request()
  }

  /** Paint with the next frame; several requests before it are one. */
  readonly request = (): void => {
    if (this.frame === 0) this.frame = requestAnimationFrame(() => this.paintNow())
  }

  dispose(): void {
    cancelAnimationFrame(this.frame)
    this.resized.disconnect()
    this.recoloured.disconnect()
  }

  private paintNow(): void {
    this.frame = 0
    const { canvas } = this
    const { clientWidth: width, clientHeight: height } = canvas
    const context = canvas.getContext('2d')
    if (context === null || width === 0 || height === 0) return
    const ratio = window.devicePixelRatio || 1
    const [pixelWidth, pixelHeight] = [Math.round(width * ratio), Math.round(height * ratio)]
    if (canvas.width !== pixelWidth) canvas.width = pixelWidth
    if (canvas.height !== pixelHeight) canvas.height = pixelHeight
    context.setTransform(ratio, 0, 0, ratio, 0, 0)
    context.clearRect(0, 0, width, height)
    this.colours ??= coloursOf(canvas)
    this.paint({ context, width, height, colours: this.colours })
  }
}

export function coloursOf(element: Element): Colours {
  const style = getComputedStyle(element)
  const token = (name: string) => style.getPropertyValue(name).trim() || '#888'
  return {
    line: token('--m-line'),
    lineStrong: token('--m-line-strong'),
    panel: token('--m-panel-raised'),
    text: token('--m-text'),
    muted: token('--m-muted'),
    accent: token('--m-accent'),
    ok: token('--m-ok'),
    warn: token('--m-warn'),
    bad: token('--m-bad'),
  }
}
