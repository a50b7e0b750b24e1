import { Button, PasswordInput, Stack, Text, TextInput, Title } from '@mantine/core'
import { useMosaicClient } from '@mosaic/react'
import { useState, type SubmitEvent } from 'react'
import { Brand } from '../shell/Brand'
import { signInFailureOf, type Failure } from './errorText'
import { FailureAlert } from './FailureAlert'

export function PasswordForm({ firstFailure }: { firstFailure: Failure | null }) {
  const [failure, setFailure] = useState(firstFailure)
  const [isBusy, setIsBusy] = useState(false)
  const client = useMosaicClient()

  const submit = async (event: SubmitEvent<HTMLFormElement>) => {
    event.preventDefault()
    const form = new FormData(event.currentTarget)
    setIsBusy(true)
    setFailure(null)
    try {
      await client.login(fieldOf(form, 'email').trim(), fieldOf(form, 'password'))
    } catch (error) {
      setFailure(signInFailureOf(error))
      setIsBusy(false)
    }
  }

  return (
    <form onSubmit={(event) => void submit(event)} aria-label="Sign in">
      <Stack gap="md">
        <Brand />
        <div>
          <Title order={1} size="h3">
            Sign in
          </Title>
          <Text c="dimmed" size="sm">
            to see and drive your robots
          </Text>
        </div>
        {failure !== null && <FailureAlert failure={failure} />}
        <TextInput name="email" label="Email" type="email" autoComplete="username" required autoFocus size="md" />
        <PasswordInput name="password" label="Password" autoComplete="current-password" required size="md" />
        <Button type="submit" size="md" loading={isBusy} fullWidth>
          Sign in
        </Button>
        <Text c="dimmed" size="xs">
          No account yet? On the server’s machine, run <code>mosaic server user add EMAIL</code>.
        </Text>
      </Stack>
    </form>
  )
}

function fieldOf(form: FormData, name: string): string {
  const value = form.get(name)
  return typeof value === 'string' ? value : ''
}
