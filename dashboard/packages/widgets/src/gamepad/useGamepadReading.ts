import { useEffect, useEffectEvent, useState } from 'react'
import type { GamepadReading } from './gamepadMapping'
import type { GamepadSource } from './GamepadSource'

export interface LiveReading {
  axes: readonly number[]
  buttons: readonly { pressed: boolean; value: number }[]
}

/**
 * The gamepad's axes and buttons as they are now, once per picture on the screen, rendered only where they changed;
 * `onChange` hears of each change.
 */
export function useGamepadReading(source: GamepadSource, onChange: (reading: LiveReading) => void): LiveReading | null {
  const [live, setLive] = useState<LiveReading | null>(null)
  const tell = useEffectEvent(onChange)
  useEffect(() => {
    let said = ''
    const look = () => {
      const reading = source.reading()
      const now = reading === null ? '' : fingerprint(reading)
      // A browser may hand out the same object again with other values: what is kept is a copy.
      const copy = reading === null ? null : copied(reading)
      if (now !== said) setLive(copy)
      if (now !== said && copy !== null) tell(copy)
      said = now
      handle = requestAnimationFrame(look)
    }
    let handle = requestAnimationFrame(look)
    return () => cancelAnimationFrame(handle)
  }, [source])
  return live
}

function copied({ axes, buttons }: GamepadReading): LiveReading {
  return { axes: [...axes], buttons: buttons.map(({ pressed, value }) => ({ pressed, value })) }
}

function fingerprint({ axes, buttons }: GamepadReading): string {
  return [...axes.map((value) => value.toFixed(2)), ...buttons.map(({ pressed, value }) => `${pressed ? 1 : 0}${value.toFixed(2)}`)].join()
}
