/** Turns mouse, touch and keys on an element into movements of a camera. */
import { orbited, panned, zoomed, type Camera } from './camera'

/** A movement of the camera. */
export type Move = (camera: Camera) => Camera

const KEY_STEP = 0.04
const KEY_ZOOM = 1.15
const WHEEL_ZOOM = 0.0016
const PINCH_ZOOM = 0.01

interface Pointer {
  x: number
  y: number
  pans: boolean
}

export class CameraControls {
  private readonly pointers = new Map<number, Pointer>()
  private readonly ended = new AbortController()

  constructor(
    private readonly element: HTMLElement,
    private readonly onMove: (move: Move) => void,
    private readonly onFit: () => void,
  ) {
    const { signal } = this.ended
    element.addEventListener('pointerdown', (event) => this.onDown(event), { signal })
    element.addEventListener('pointermove', (event) => this.onPointerMove(event), { signal })
    for (const type of ['pointerup', 'pointercancel', 'lostpointercapture'] as const) {
      element.addEventListener(type, (event) => this.pointers.delete(event.pointerId), { signal })
    }
    element.addEventListener('wheel', (event) => this.onWheel(event), { signal, passive: false })
    element.addEventListener('keydown', (event) => this.onKey(event), { signal })
    element.addEventListener('dblclick', onFit, { signal })
    element.addEventListener('contextmenu', (event) => event.preventDefault(), { signal })
  }

  dispose(): void {
    this.ended.abort()
  }

  private onDown(event: PointerEvent): void {
    this.element.focus({ preventScroll: true })
    this.element.setPointerCapture(event.pointerId)
    this.pointers.set(event.pointerId, { x: event.clientX, y: event.clientY, pans: event.button > 0 || event.shiftKey })
  }

  private onPointerMove(event: PointerEvent): void {
    const pointer = this.pointers.get(event.pointerId)
    if (pointer === undefined) return
    const before = this.spread()
    const height = Math.max(1, this.element.clientHeight)
    // Two fingers: each moves the middle by half of its own way.
    const share = 1 / height / Math.max(1, this.pointers.size)
    const [right, down] = [(event.clientX - pointer.x) * share, (event.clientY - pointer.y) * share]
    const pans = pointer.pans || this.pointers.size > 1
    pointer.x = event.clientX
    pointer.y = event.clientY
    const after = this.spread()
    const factor = before > 0 && after > 0 ? after / before : 1
    this.onMove((camera) => zoomed(pans ? panned(camera, right, down) : orbited(camera, right, down), factor))
  }

  /** Distance of two fingers in pixels; 0 where there are not two. */
  private spread(): number {
    const [one, other] = [...this.pointers.values()]
    return one === undefined || other === undefined ? 0 : Math.hypot(one.x - other.x, one.y - other.y)
  }

  /** A wheel scrolls the page until the picture has the focus; a pinch on a touch pad (Ctrl + wheel) always zooms. */
  private onWheel(event: WheelEvent): void {
    if (!event.ctrlKey && document.activeElement !== this.element) return
    event.preventDefault()
    const pixels = event.deltaMode === 0 ? event.deltaY : event.deltaY * 16
    const factor = Math.exp(-pixels * (event.ctrlKey ? PINCH_ZOOM : WHEEL_ZOOM))
    this.onMove((camera) => zoomed(camera, factor))
  }

  private onKey(event: KeyboardEvent): void {
    if (event.ctrlKey || event.altKey || event.metaKey) return
    const move = moveOfKey(event.key, event.shiftKey)
    if (move === null) return
    event.preventDefault()
    event.stopPropagation() // the arrows also drive
    if (move === 'fit') this.onFit()
    else this.onMove(move)
  }
}

/** What a key does to the camera; null: nothing, it is somebody else's. */
export function moveOfKey(key: string, isShifted: boolean): Move | 'fit' | null {
  const turn = isShifted ? panned : orbited
  switch (key) {
    case 'ArrowLeft':
      return (camera) => turn(camera, -KEY_STEP, 0)
    case 'ArrowRight':
      return (camera) => turn(camera, KEY_STEP, 0)
    case 'ArrowUp':
      return (camera) => turn(camera, 0, -KEY_STEP)
    case 'ArrowDown':
      return (camera) => turn(camera, 0, KEY_STEP)
    case '+':
    case '=':
      return (camera) => zoomed(camera, KEY_ZOOM)
    case '-':
      return (camera) => zoomed(camera, 1 / KEY_ZOOM)
    case 'f':
    case 'Home':
      return 'fit'
    default:
      return null
  }
}
