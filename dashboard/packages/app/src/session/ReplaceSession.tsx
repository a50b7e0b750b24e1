import { Button, Group, Paper, Stack, Text, Title } from '@mantine/core'
import { useMosaicClient, useReadable } from '@mosaic/react'
import { Brand } from '../shell/Brand'
import { useTitle } from '../shell/useTitle'
import { type Failure, FailureAlert } from '@mosaic/widgets'
import classes from './SignInPage.module.css'

export interface ReplaceSessionProps {
  /** Why the code did not sign in. */
  failure: Failure | null
  isBusy: boolean
  onAnswer: (takesCode: boolean) => void
}

/** Asks somebody who is signed in whether the one-time code of a link may sign another account in. */
export function ReplaceSession({ failure, isBusy, onAnswer }: ReplaceSessionProps) {
  useTitle('Sign in with the link?')
  const session = useReadable(useMosaicClient().session)
  return (
    <main className={classes.root}>
      <Paper className={classes.panel} withBorder p="xl" radius="md">
        <Stack gap="md">
          <Brand />
          <Title order={1} size="h3">
            Sign in with the link?
          </Title>
          {failure !== null && <FailureAlert failure={failure} />}
          <Text size="sm">
            {session === null ? (
              'Somebody is signed in with this browser; the server could not say yet who it is. '
            ) : (
              <>
                You are signed in as <strong>{session.user.email}</strong>.{' '}
              </>
            )}
            The link that was opened holds a code that signs in somebody, perhaps
            another account; you would be signed out, and your connections would end.
          </Text>
          <Group justify="flex-end">
            <Button variant="default" disabled={isBusy} onClick={() => onAnswer(true)}>
              Sign in with the link
            </Button>
            <Button autoFocus disabled={isBusy} onClick={() => onAnswer(false)}>
              Stay signed in
            </Button>
          </Group>
        </Stack>
      </Paper>
    </main>
  )
}
