import { Button, type ButtonProps } from '@mantine/core'
import { useCallback, useEffect, useRef, useState, type KeyboardEvent, type MouseEvent, type ReactNode } from 'react'
import classes from './control.module.css'

/** The style sheet fills the button in the same time. */
export const HOLD_MS = 1000
/** A screen reader can't hold: it presses twice, within this long. */
const CONFIRM_WITHIN_MS = 5000

export interface HoldButtonProps extends Pick<ButtonProps, 'color' | 'size' | 'disabled' | 'loading' | 'variant'> {
  children: ReactNode
  /** Said in place of the label while it is held. */
  holding: string
  onHeld: () => void
}

/** For what must not happen by accident: acts when it was held for a second, by pointer or keyboard. */
export function HoldButton({ children, holding, onHeld, ...button }: HoldButtonProps) {
  const { isHolding, begin, end } = useHold(onHeld)
  const { isArmed, press } = useTwice(onHeld)
  const isHoldKey = ({ key }: KeyboardEvent) => key === ' ' || key === 'Enter'
  return (
    <Button
      {...button}
      className={classes.hold}
      data-holding={isHolding}
      onPointerDown={(event) => event.button === 0 && begin()}
      onPointerUp={end}
      onPointerLeave={end}
      onPointerCancel={end}
      onBlur={end}
      onKeyDown={(event) => {
        if (!isHoldKey(event)) return
        event.preventDefault()
        if (!event.repeat) begin()
      }}
      onKeyUp={(event) => {
        if (!isHoldKey(event)) return
        // Releasing the space bar would click.
        event.preventDefault()
        end()
      }}
      onClick={(event) => isVirtual(event) && press()}
      onContextMenu={(event) => event.preventDefault()}
    >
      {isArmed ? 'Press again to confirm' : isHolding ? holding : children}
    </Button>
  )
}

/** A click that neither pointer nor key made: assistive technology. */
function isVirtual(event: MouseEvent): boolean {
  return event.detail === 0
}

function useHold(onHeld: () => void): { isHolding: boolean; begin: () => void; end: () => void } {
  const [isHolding, setIsHolding] = useState(false)
  const timer = useRef<ReturnType<typeof setTimeout>>(undefined)
  const end = useCallback(() => {
    clearTimeout(timer.current)
    setIsHolding(false)
  }, [])
  useEffect(() => () => clearTimeout(timer.current), [])
  const begin = () => {
    end()
    setIsHolding(true)
    timer.current = setTimeout(() => {
      setIsHolding(false)
      onHeld()
    }, HOLD_MS)
  }
  return { isHolding, begin, end }
}

function useTwice(onConfirmed: () => void): { isArmed: boolean; press: () => void } {
  const [isArmed, setIsArmed] = useState(false)
  useEffect(() => {
    if (!isArmed) return undefined
    const timer = setTimeout(() => setIsArmed(false), CONFIRM_WITHIN_MS)
    return () => clearTimeout(timer)
  }, [isArmed])
  const press = () => {
    if (isArmed) onConfirmed()
    setIsArmed(!isArmed)
  }
  return { isArmed, press }
}
