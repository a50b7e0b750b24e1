import { Button } from '@mantine/core'
import { IconSend } from '@tabler/icons-react'
import type { ReactNode } from 'react'
import type { Sender } from '../JsonSender/useSender'
import classes from './JointCommand.module.css'

/** What came of the last command, and the button for the next. */
export function SendRow({ sender, isReady, onSend, children }: { sender: Sender; isReady: boolean; onSend: () => void; children?: ReactNode }) {
  return (
    <div className={classes.foot}>
      <span className={classes.said} role="status" data-tone={sender.said.tone}>
        {sender.said.text}
      </span>
      {children}
      <Button size="compact-md" leftSection={<IconSend size={14} />} disabled={!sender.canSend || !isReady} onClick={onSend}>
        Move
      </Button>
    </div>
  )
}
