import { Alert, Button, Group, Stack, TextInput } from '@mantine/core'
import { useMosaicClient } from '@mosaic/react'
import type { SubmitEvent } from 'react'
import { type Making, TokenDialog } from './TokenDialog'

export interface AddRobotDialogProps {
  onClose: () => void
}

/** Registers a robot and shows its token, once, inside a file that is ready to run. */
export default function AddRobotDialog({ onClose }: AddRobotDialogProps) {
  return (
    <TokenDialog title="Add a robot" onClose={onClose}>
      {(making) => <AddRobot making={making} onCancel={onClose} />}
    </TokenDialog>
  )
}

interface AddRobotProps {
  making: Making
  onCancel: () => void
}

function AddRobot({ making: { make, isBusy, failure }, onCancel }: AddRobotProps) {
  const client = useMosaicClient()
  const add = async (name: string) => {
    const { id } = await client.api.createRobot({ name })
    const token = await client.api.newRobotToken(id)
    client.refreshRobots().catch(() => undefined) // the list asks again by itself; the token is there
    return { robotId: id, token }
  }
  const submit = (event: SubmitEvent<HTMLFormElement>) => {
    event.preventDefault()
    const name = new FormData(event.currentTarget).get('name')
    make(() => add(typeof name === 'string' ? name.trim() : ''))
  }

  return (
    <form onSubmit={submit}>
      <Stack>
        {failure !== null && (
          <Alert color="red" title={failure.message} role="alert">
            {failure.cure}
          </Alert>
        )}
        <TextInput name="name" label="Name" placeholder="kitchen-bot" required maxLength={100} data-autofocus />
        <Group justify="flex-end">
          <Button variant="default" disabled={isBusy} onClick={onCancel}>
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
