import { Alert } from '@mantine/core'
import { IconAlertTriangle } from '@tabler/icons-react'
import type { Failure } from './failure'

/** Says what failed, and its cure; read out at once. */
export function FailureAlert({ failure }: { failure: Failure }) {
  return (
    <Alert color="red" variant="light" icon={<IconAlertTriangle size={18} />} title={failure.message} role="alert">
      {failure.cure}
    </Alert>
  )
}
