import { Alert, Button, Group, Stack, TextInput } from '@mantine/core'
import { useMosaicClient } from '@mosaic/react'
import { useState, type SubmitEvent } from 'react'
import { type Failure, failureOf } from '@mosaic/widgets'
import type { RobotCredentials } from '@mosaic/robot'
import { TokenDialog } from './TokenDialog'

export interface AddRobotDialogProps {
  onClose: () => void
}

/** Registers a robot and shows its token, once, inside a file that is ready to run. */
export default function AddRobotDialog({ onClose }: AddRobotDialogProps) {
  return (
    <TokenDialog title="Add a robot" onClose={onClose}>
      {(show) => <AddRobot onAdded={show} onCancel={onClose} />}
    </TokenDialog>
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
