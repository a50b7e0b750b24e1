import { Button } from '@mantine/core'
import { IconHandStop, IconSend } from '@tabler/icons-react'
import type { ReactNode } from 'react'
import type { Sender } from '../JsonSender/useSender'
import classes from './JointCommand.module.css'

export interface SendRowProps {
  sender: Sender
  isReady: boolean
  onSend: () => void
  /** Ends the motion that goes on; null: none does. */
  onHold: (() => void) | null
  children?: ReactNode
}

/** What came of the last command, and the buttons for the next and for ending this one. */
export function SendRow({ sender, isReady, onSend, onHold, children }: SendRowProps) {
  return (
    <div className={classes.foot}>
      <span className={classes.said} role="status" data-tone={sender.said.tone} title={sender.said.text}>
        {sender.said.text}
      </span>
      {children}
      {onHold !== null && (
        <Button size="compact-md" variant="default" leftSection={<IconHandStop size={14} />} onClick={onHold}>
          Hold
        </Button>
      )}
      <Button size="compact-md" leftSection={<IconSend size={14} />} disabled={!sender.canSend || !isReady} onClick={onSend}>
        Move
      </Button>
    </div>
  )
}
