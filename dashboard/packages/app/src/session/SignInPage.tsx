import { Alert, Button, Paper, PasswordInput, Stack, Text, TextInput, Title } from '@mantine/core'
import { useMosaicClient } from '@mosaic/react'
import { IconAlertTriangle } from '@tabler/icons-react'
import { useState, type SubmitEvent } from 'react'
import { useTitle } from '../shell/useTitle'
import { Brand } from '../shell/Brand'
import { ColorSchemeToggle } from '../shell/ColorSchemeToggle'
import { failureOf, type Failure } from './errorText'
import classes from './SignInPage.module.css'

export interface SignInPageProps {
  /** Why a one-time code did not sign in, or why the last session ended. */
  firstFailure: Failure | null
}

export function SignInPage({ firstFailure }: SignInPageProps) {
  useTitle('Sign in')
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
      setFailure(failureOf(error))
      setIsBusy(false)
    }
  }

  return (
    <main className={classes.root}>
      <div className={classes.corner}>
        <ColorSchemeToggle />
      </div>
      <Paper className={classes.panel} withBorder p="xl" radius="md">
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
      </Paper>
    </main>
  )
}

function FailureAlert({ failure }: { failure: Failure }) {
  return (
    <Alert color="red" variant="light" icon={<IconAlertTriangle size={18} />} title={failure.message} role="alert">
      {failure.cure}
    </Alert>
  )
}

function fieldOf(form: FormData, name: string): string {
  const value = form.get(name)
  return typeof value === 'string' ? value : ''
}
