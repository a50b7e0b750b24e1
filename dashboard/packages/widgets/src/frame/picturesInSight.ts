/** Tells a drive pad whether the picture that leads its robot's page can be seen on the screen. */

/** A third: a notice may lie over a picture, but who drives must see where to. */
const ENOUGH = 1 / 3
/** Where a picture is looked at, along each side. */
const PROBES = [1 / 6, 3 / 6, 5 / 6]
/** What covers a picture (a dialog, a sheet) tells nobody: it is looked for this often. */
const LOOK_EVERY_MS = 250

export interface Screen {
  /** What part of the page the person sees: less than the window while two fingers have zoomed in. */
  left: number
  top: number
  right: number
  bottom: number
  /** What fills it, if anything does. */
  full: Element | null
  /** What lies uppermost there. */
  uppermost(x: number, y: number): Element | null
}

const pictures = new Set<{ robotId: string; element: Element }>()

/** Another picture of this robot is on the page; returns how it is taken off. */
export function addPicture(robotId: string, element: Element): () => void {
  const picture = { robotId, element }
  pictures.add(picture)
  return () => void pictures.delete(picture)
}

/**
 * Whether one who drives this robot sees where to: the first of its pictures, or the one that fills the screen.
 * True where the page has none: a robot without a camera is looked at directly.
 */
export function isPictureInSight(robotId: string, screen: Screen = screenOf(window)): boolean {
  const leading = leadingPicture(robotId, screen)
  return leading === undefined || shareInSight(leading, screen) >= ENOUGH
}

/** Whether somebody who drives this robot looks at the picture in there. */
export function isLeading(robotId: string, element: Element, screen: Screen = screenOf(window)): boolean {
  const leading = leadingPicture(robotId, screen)
  return leading !== undefined && (leading.contains(element) || element.contains(leading))
}

function leadingPicture(robotId: string, screen: Screen): Element | undefined {
  const shown = [...pictures].filter((picture) => picture.robotId === robotId).map(({ element }) => element)
  return shown.find((element) => isFull(element, screen)) ?? shown.sort(inDocumentOrder)[0]
}

/** How much of the element is on the screen with nothing lying over it. */
export function shareInSight(element: Element, screen: Screen): number {
  const { left, top, width, height } = ((isFull(element, screen) ? screen.full : null) ?? element).getBoundingClientRect()
  if (width === 0 || height === 0) return 0
  const points = PROBES.flatMap((down) => PROBES.map((across) => ({ x: left + across * width, y: top + down * height })))
  return points.filter((point) => isSeen(element, point, screen)).length / points.length
}

/** Where the picture in an element lies, without the bars beside it; the element itself where it shows none yet. */
export function pictureRect(element: Element): DOMRect {
  const box = element.getBoundingClientRect()
  const pictured = [...element.querySelectorAll('video, canvas, img')].map(naturalSize).find(({ width, height }) => width * height > 0)
  const around = pictured?.of.getBoundingClientRect()
  if (pictured === undefined || around === undefined || around.width * around.height === 0) return box
  const scale = Math.min(around.width / pictured.width, around.height / pictured.height)
  const [width, height] = [pictured.width * scale, pictured.height * scale]
  return new DOMRect(around.left + (around.width - width) / 2, around.top + (around.height - height) / 2, width, height)
}

function naturalSize(of: Element): { of: Element; width: number; height: number } {
  if (of instanceof HTMLVideoElement) return { of, width: of.videoWidth, height: of.videoHeight }
  if (of instanceof HTMLImageElement) return { of, width: of.naturalWidth, height: of.naturalHeight }
  return of instanceof HTMLCanvasElement ? { of, width: of.width, height: of.height } : { of, width: 0, height: 0 }
}

function isFull(element: Element, { full }: Screen): boolean {
  return full !== null && element.contains(full)
}

function isSeen(element: Element, { x, y }: { x: number; y: number }, screen: Screen): boolean {
  if (x < screen.left || x >= screen.right || y < screen.top || y >= screen.bottom) return false
  return element.contains(screen.uppermost(x, y))
}

function screenOf(page: Window): Screen {
  const { visualViewport: seen, document } = page
  const [left, top] = [seen?.offsetLeft ?? 0, seen?.offsetTop ?? 0]
  return {
    left,
    top,
    right: left + (seen?.width ?? page.innerWidth),
    bottom: top + (seen?.height ?? page.innerHeight),
    full: document.fullscreenElement,
    uppermost: (x, y) => document.elementFromPoint(x, y),
  }
}

function inDocumentOrder(one: Element, other: Element): number {
  return one.compareDocumentPosition(other) & Node.DOCUMENT_POSITION_FOLLOWING ? -1 : 1
}

/** Calls back whenever what is in sight may have changed. */
export function watchSight(changed: () => void): () => void {
  const ended = new AbortController()
  const { signal } = ended
  window.addEventListener('scroll', changed, { signal, capture: true, passive: true })
  window.addEventListener('resize', changed, { signal })
  document.addEventListener('fullscreenchange', changed, { signal })
  window.visualViewport?.addEventListener('scroll', changed, { signal })
  window.visualViewport?.addEventListener('resize', changed, { signal })
  const looks = setInterval(changed, LOOK_EVERY_MS)
  signal.addEventListener('abort', () => clearInterval(looks))
  return () => ended.abort()
}
