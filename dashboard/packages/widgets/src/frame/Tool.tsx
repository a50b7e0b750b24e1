import { ActionIcon, Tooltip } from '@mantine/core'
import type { ReactNode } from 'react'

export interface ToolProps {
  label: string
  isOn?: boolean
  isDisabled?: boolean
  onClick: () => void
  children: ReactNode
}

/** A small button over what a widget draws. */
export function Tool({ label, isOn, isDisabled = false, onClick, children }: ToolProps) {
  return (
    <Tooltip label={label} openDelay={400}>
      <ActionIcon size="sm" variant="default" aria-label={label} aria-pressed={isOn} disabled={isDisabled} onClick={onClick}>
        {children}
      </ActionIcon>
    </Tooltip>
  )
}
