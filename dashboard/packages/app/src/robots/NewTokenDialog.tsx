import { Alert, Button, Group, Stack, Text } from '@mantine/core'
import { useMosaicClient } from '@mosaic/react'
import { useState } from 'react'
import { type Failure, failureOf } from '@mosaic/widgets'
import type { RobotCredentials } from '@mosaic/robot'
import { TokenDialog } from './TokenDialog'

export interface NewTokenDialogProps {
  robotId: string
  name: string
  onClose: () => void
}

/** Issues a robot's token again, for whoever lost it or fears that others have it. */
export default function NewTokenDialog({ robotId, name, onClose }: NewTokenDialogProps) {
  return (
    <TokenDialog title={`New token for ${name}`} onClose={onClose}>
      {(show) => <Question robotId={robotId} onIssued={show} onCancel={onClose} />}
    </TokenDialog>
  )
}

interface QuestionProps {
  robotId: string
  onIssued: (credentials: RobotCredentials) => void
  onCancel: () => void
}

function Question({ robotId, onIssued, onCancel }: QuestionProps) {
  const client = useMosaicClient()
  const [failure, setFailure] = useState<Failure | null>(null)
  const [isBusy, setIsBusy] = useState(false)

  const issue = async () => {
    setIsBusy(true)
    try {
      onIssued({ robotId, token: await client.api.newRobotToken(robotId) })
    } catch (error) {
      setFailure(failureOf(error))
      setIsBusy(false)
    }
  }

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
        <Button variant="default" onClick={onCancel}>
          Cancel
        </Button>
        <Button color="red.9" loading={isBusy} onClick={() => void issue()}>
          End the old token and make a new one
        </Button>
      </Group>
    </Stack>
  )
}
