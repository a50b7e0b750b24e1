import { Alert, Button, Group, Stack, Text } from '@mantine/core'
import { useMosaicClient } from '@mosaic/react'
import { type Making, TokenDialog } from './TokenDialog'

export interface NewTokenDialogProps {
  robotId: string
  name: string
  onClose: () => void
}

/** Issues a robot's token again, for whoever lost it or fears that others have it. */
export default function NewTokenDialog({ robotId, name, onClose }: NewTokenDialogProps) {
  return (
    <TokenDialog title={`New token for ${name}`} onClose={onClose}>
      {(making) => <Question robotId={robotId} making={making} onCancel={onClose} />}
    </TokenDialog>
  )
}

interface QuestionProps {
  robotId: string
  making: Making
  onCancel: () => void
}

function Question({ robotId, making: { make, isBusy, failure }, onCancel }: QuestionProps) {
  const client = useMosaicClient()
  const issue = async () => ({ robotId, token: await client.api.newRobotToken(robotId) })
  return (
    <Stack>
      {failure !== null && (
        <Alert color="red" title={failure.message} role="alert">
          {failure.cure}
        </Alert>
      )}
      <Text size="sm">
        The token that the robot has now ends at once: it is put off the server, and nobody can connect to it until the new one is in its{' '}
        <code>mosaic_config.yaml</code>.
      </Text>
      <Group justify="flex-end">
        <Button variant="default" disabled={isBusy} onClick={onCancel}>
          Cancel
        </Button>
        <Button color="red.9" loading={isBusy} onClick={() => make(issue)}>
          End the old token and make a new one
        </Button>
      </Group>
    </Stack>
  )
}
