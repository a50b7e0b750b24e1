import { Button, Code, Group, Modal, Stack, Text } from '@mantine/core'
import { useState, type ReactNode } from 'react'
import { CopyButton } from '../shell/CopyButton'
import { robotYaml } from './robotYaml'

export interface TokenDialogProps {
  title: string
  onClose: () => void
  /** What is asked before there is a token; `show` shows the one that was made. */
  children: (show: (credentials: RobotCredentials) => void) => ReactNode
}

/** Asks, then shows a robot's token, once: from then on nothing but "Done" takes it away. */
export function TokenDialog({ title, onClose, children }: TokenDialogProps) {
  const [credentials, setCredentials] = useState<RobotCredentials | null>(null)
  const isLosable = credentials === null
  return (
    <Modal
      opened
      onClose={onClose}
      title={title}
      size="lg"
      centered
      closeOnClickOutside={isLosable}
      closeOnEscape={isLosable}
      withCloseButton={isLosable}
    >
      {credentials === null ? children(setCredentials) : <Token credentials={credentials} onDone={onClose} />}
    </Modal>
  )
}

function Token({ credentials, onDone }: { credentials: RobotCredentials; onDone: () => void }) {
  const yaml = robotYaml(window.location.origin, credentials)
  return (
    <Stack>
      <Text size="sm">
        Save this on the robot as <Code>mosaic_config.yaml</Code> and start it with <Code>mosaic run</Code>; a robot that has such a
        file already needs the new <Code>token</Code> alone. It is shown only now.
      </Text>
      <Code block tabIndex={0} aria-label="mosaic_config.yaml">
        {yaml}
      </Code>
      <Group justify="flex-end" align="flex-start">
        <CopyButton text={yaml} />
        <Button onClick={onDone}>Done</Button>
      </Group>
    </Stack>
  )
}
