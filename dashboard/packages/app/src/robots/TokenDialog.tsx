import { Button, Code, Group, Modal, Stack, Text } from '@mantine/core'
import type { RobotCredentials } from '@mosaic/robot'
import { failureOf, type Failure } from '@mosaic/widgets'
import { useState, type ReactNode } from 'react'
import { CopyButton } from '../shell/CopyButton'
import { robotYaml } from './robotYaml'

export interface TokenDialogProps {
  title: string
  onClose: () => void
  /** What is asked before there is a token. */
  children: (making: Making) => ReactNode
}

export interface Making {
  /** Makes a token, and shows it. */
  make: (request: () => Promise<RobotCredentials>) => void
  isBusy: boolean
  failure: Failure | null
}

/** Asks, then shows a robot's token, once: from the moment that one is being made nothing but "Done" takes it away. */
export function TokenDialog({ title, onClose, children }: TokenDialogProps) {
  const [credentials, setCredentials] = useState<RobotCredentials | null>(null)
  const [failure, setFailure] = useState<Failure | null>(null)
  const [isBusy, setIsBusy] = useState(false)
  const make = (request: () => Promise<RobotCredentials>) => {
    setIsBusy(true)
    setFailure(null)
    request()
      .then(setCredentials)
      .catch((error: unknown) => setFailure(failureOf(error)))
      .finally(() => setIsBusy(false))
  }
  const isLosable = credentials === null && !isBusy
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
      {credentials === null ? children({ make, isBusy, failure }) : <Token credentials={credentials} onDone={onClose} />}
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
