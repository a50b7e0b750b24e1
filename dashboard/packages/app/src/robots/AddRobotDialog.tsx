import { Alert, Button, Code, CopyButton, Group, Modal, Stack, Text, TextInput } from '@mantine/core'
import { useMosaicClient } from '@mosaic/react'
import { IconCheck, IconCopy } from '@tabler/icons-react'
import { useState, type SubmitEvent } from 'react'
import { failureOf, type Failure } from '../session/errorText'
import { robotYaml, type RobotCredentials } from './robotYaml'

export interface AddRobotDialogProps {
  isOpen: boolean
  onClose: () => void
}

/** Registers a robot and shows its token, once, inside a file that is ready to run. */
export function AddRobotDialog({ isOpen, onClose }: AddRobotDialogProps) {
  const [credentials, setCredentials] = useState<RobotCredentials | null>(null)
  const close = () => {
    setCredentials(null)
    onClose()
  }
  // The token is shown once: nothing but "Done" takes it away.
  const isLosable = credentials === null
  return (
    <Modal
      opened={isOpen}
      onClose={close}
      title="Add a robot"
      size="lg"
      centered
      closeOnClickOutside={isLosable}
      closeOnEscape={isLosable}
      withCloseButton={isLosable}
    >
      {credentials === null ? <AddRobot onAdded={setCredentials} onCancel={close} /> : <NewRobot credentials={credentials} onDone={close} />}
    </Modal>
  )
}

interface AddRobotProps {
  onAdded: (credentials: RobotCredentials) => void
  onCancel: () => void
}

function AddRobot({ onAdded, onCancel }: AddRobotProps) {
  const client = useMosaicClient()
  const [failure, setFailure] = useState<Failure | null>(null)
  const [isBusy, setIsBusy] = useState(false)

  const submit = async (event: SubmitEvent<HTMLFormElement>) => {
    event.preventDefault()
    const name = new FormData(event.currentTarget).get('name')
    setIsBusy(true)
    setFailure(null)
    try {
      const { id } = await client.api.createRobot({ name: typeof name === 'string' ? name.trim() : '' })
      onAdded({ robotId: id, token: await client.api.newRobotToken(id) })
      await client.refreshRobots()
    } catch (error) {
      setFailure(failureOf(error))
    }
    setIsBusy(false)
  }

  return (
    <form onSubmit={(event) => void submit(event)}>
      <Stack>
        {failure !== null && (
          <Alert color="red" title={failure.message} role="alert">
            {failure.cure}
          </Alert>
        )}
        <TextInput name="name" label="Name" placeholder="kitchen-bot" required maxLength={100} data-autofocus />
        <Group justify="flex-end">
          <Button variant="default" onClick={onCancel}>
            Cancel
          </Button>
          <Button type="submit" loading={isBusy}>
            Add robot
          </Button>
        </Group>
      </Stack>
    </form>
  )
}

function NewRobot({ credentials, onDone }: { credentials: RobotCredentials; onDone: () => void }) {
  const yaml = robotYaml(window.location.origin, credentials)
  return (
    <Stack>
      <Text size="sm">
        Save this on the robot as <Code>mosaic_config.yaml</Code> and start it with <Code>mosaic run</Code>. The token is shown
        only now.
      </Text>
      <Code block tabIndex={0} aria-label="mosaic_config.yaml">{yaml}</Code>
      <Group justify="flex-end">
        <CopyButton value={yaml}>
          {({ copied, copy }) => (
            <Button
              variant="default"
              leftSection={copied ? <IconCheck size={16} /> : <IconCopy size={16} />}
              onClick={copy}
            >
              {copied ? 'Copied' : 'Copy'}
            </Button>
          )}
        </CopyButton>
        <Button onClick={onDone}>Done</Button>
      </Group>
    </Stack>
  )
}
