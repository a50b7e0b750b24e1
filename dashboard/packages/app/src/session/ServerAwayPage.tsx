import { Button, Group, Loader, Paper, Stack, Text, Title } from '@mantine/core'
import type { MosaicClient } from '@mosaic/client'
import { useMosaicClient } from '@mosaic/react'
import { useEffect } from 'react'
import { Brand } from '../shell/Brand'
import { useTitle } from '../shell/useTitle'
import type { Failure } from '@mosaic/widgets'
import classes from './SignInPage.module.css'

/** Soon enough for who waits before the screen; a server that begins is not kept from it. */
export const RETRY_MS = 3000

/** Waits with a remembered session for the server that could not be asked about it, and goes on when it answers. */
export function ServerAwayPage({ failure }: { failure: Failure | null }) {
  const client = useMosaicClient()
  useTitle('Waiting for the server')
  useEffect(() => restoredAgain(client), [client])
  return (
    <main className={classes.root}>
      <Paper className={classes.panel} withBorder p="xl" radius="md">
        <Stack gap="md">
          <Brand />
          <div role="status">
            <Title order={1} size="h3">
              {failure?.message ?? 'The server is away'}
            </Title>
            <Text c="dimmed" size="sm" mt={4}>
              {failure?.cure} You stay signed in: this page goes on by itself when the server answers.
            </Text>
          </div>
          <Group justify="space-between">
            <Loader size="sm" aria-hidden />
            <Button variant="subtle" color="gray" onClick={() => client.logout()}>
              Sign out
            </Button>
          </Group>
        </Stack>
      </Paper>
    </main>
  )
}

/** Asks again and again, and at once when the network is back, until what this returns is called. */
function restoredAgain(client: MosaicClient): () => void {
  let timer: ReturnType<typeof setTimeout>
  const over = new AbortController()
  const ask = async (): Promise<void> => {
    clearTimeout(timer)
    await client.restore()
    if (!over.signal.aborted) wait()
  }
  const wait = (): void => {
    clearTimeout(timer)
    timer = setTimeout(() => void ask(), RETRY_MS)
  }
  wait()
  window.addEventListener('online', () => void ask(), { signal: over.signal })
  over.signal.addEventListener('abort', () => clearTimeout(timer))
  return () => over.abort()
}
