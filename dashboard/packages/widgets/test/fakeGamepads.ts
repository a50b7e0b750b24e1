/** Gamepads that a test plugs in and presses; `navigator.getGamepads` answers with them. */

export interface FakePad {
  id: string
  index: number
  mapping: string
  connected: boolean
  axes: number[]
  buttons: { pressed: boolean; touched: boolean; value: number }[]
}

export interface FakeGamepads {
  plugIn(options?: { id?: string; mapping?: string; index?: number }): FakePad
  unplug(pad: FakePad): void
  restore(): void
}

export const XBOX = 'Xbox 360 Controller (STANDARD GAMEPAD Vendor: 045e Product: 028e)'

export function fakeGamepads(page: Window = window): FakeGamepads {
  const slots: (FakePad | null)[] = [null, null, null, null]
  const before = Object.getOwnPropertyDescriptor(page.navigator, 'getGamepads')
  Object.defineProperty(page.navigator, 'getGamepads', { configurable: true, value: () => slots })
  return {
    plugIn: ({ id = XBOX, mapping = 'standard', index = 0 } = {}) => {
      const buttons = Array.from({ length: 17 }, () => ({ pressed: false, touched: false, value: 0 }))
      const pad: FakePad = { id, index, mapping, connected: true, axes: [0, 0, 0, 0], buttons }
      slots[index] = pad
      page.dispatchEvent(new Event('gamepadconnected'))
      return pad
    },
    unplug: (pad) => {
      pad.connected = false
      slots[pad.index] = null
      page.dispatchEvent(new Event('gamepaddisconnected'))
    },
    restore: () => {
      if (before === undefined) delete (page.navigator as { getGamepads?: unknown }).getGamepads
      else Object.defineProperty(page.navigator, 'getGamepads', before)
    },
  }
}

export function setPressed(pad: FakePad, button: number, pressed: boolean): void {
  pad.buttons[button] = { pressed, touched: pressed, value: pressed ? 1 : 0 }
}
